// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Why an asset has to be baked, or need not be.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/store/cache.h"
#include "cli/batch/job.h"

namespace vps::cli::batch {

/// An asset beside what is wanted.
struct Standing {
  std::optional<bake::BakeRecord> wanted;  ///< nothing when the mesh cannot be read or understood: baking it says why
  std::vector<std::string> reasons;  ///< to bake, such as "voxel was 5 mm, is 4 mm"; empty: the asset is up to date
};

/// Reads the mesh's bytes and the asset's, all of both; no modification time counts. @throw BatchError
[[nodiscard]] Standing compare_with_asset(const Job& job);

/// What differs between two records, one sentence each.
[[nodiscard]] std::vector<std::string> differences(const bake::BakeRecord& had, const bake::BakeRecord& wanted);

/// The settings of a record for people, one line each, with the names that options have.
[[nodiscard]] std::vector<std::string> readable_settings(const bake::BakeRecord& record);

}  // namespace vps::cli::batch

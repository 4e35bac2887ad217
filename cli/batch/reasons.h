// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Finds out why an asset has to be baked, or that it is up to date.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bake/store/cache.h"
#include "cli/batch/job.h"

namespace vps::cli::batch {

/// An asset compared with the wanted one.
struct Standing {
  std::optional<bake::BakeRecord> wanted;  ///< nothing when the mesh cannot be read or understood; the bake reports why
  std::vector<std::string> reasons;  ///< to bake, such as "voxel was 5 mm, is 4 mm"; empty: the asset is up to date
};

/// Reads all bytes of the mesh and the asset. Modification times are ignored. @throw BatchError
[[nodiscard]] Standing compare_with_asset(const Job& job);

/// What differs between two records, one sentence each.
[[nodiscard]] std::vector<std::string> differences(const bake::BakeRecord& had, const bake::BakeRecord& wanted);

/// The settings of a record for people, one line each, with the names of the options.
[[nodiscard]] std::vector<std::string> readable_settings(const bake::BakeRecord& record);

}  // namespace vps::cli::batch

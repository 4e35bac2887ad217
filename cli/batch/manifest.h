// SPDX-License-Identifier: GPL-3.0-or-later
/// @file vpsbake.json: what a folder of assets holds. The same assets give the same bytes, however they were baked.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

inline constexpr const char* kManifest = "vpsbake.json";

struct Manifest {
  nlohmann::ordered_json json;       ///< docs/schemas/batch_manifest.schema.json
  std::vector<std::string> missing;  ///< assets that are not there or whole, or were baked with other settings
};

/// How much of each asset is read. A header has the sizes and hashes of all else.
enum class Checking { header, everything };

/// Looks at every job's asset, and reads none of a mesh. Jobs with a refusal have none.
[[nodiscard]] Manifest gather_manifest(const std::filesystem::path& folder, const std::vector<Job>& jobs,
                                       Checking checking = Checking::header);

/// Why the folder's vpsbake.json may not be replaced: empty when it may.
[[nodiscard]] std::string manifest_refusal(const std::filesystem::path& folder);

/// Writes it into the folder, and where nothing changed only marks it as new, for make. @throw WriteError
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);

/// Assets of an earlier manifest in the folder that no job makes any more. @return their names
[[nodiscard]] std::vector<std::string> left_over(const std::filesystem::path& folder, const std::vector<Job>& jobs);

}  // namespace vps::cli::batch

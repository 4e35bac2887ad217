// SPDX-License-Identifier: GPL-3.0-or-later
/// @file vpsbake.json: the list of a folder's assets. The same assets give the same bytes, however they were baked.
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
  std::vector<std::string> missing;  ///< assets that are absent or damaged, or were baked with other settings
};

/// How much of each asset is read. The header has the sizes and hashes of the rest.
enum class Checking { header, everything };

/// Reads every job's asset, and no mesh. Assets of jobs with a refusal count as missing.
[[nodiscard]] Manifest gather_manifest(const std::filesystem::path& folder, const std::vector<Job>& jobs,
                                       Checking checking = Checking::header);

/// Why the folder's vpsbake.json must not be replaced; empty when it may.
[[nodiscard]] std::string manifest_refusal(const std::filesystem::path& folder);

/// Writes the manifest into the folder. Where nothing changed it only sets the file's time, for make. @throw WriteError
void write_manifest(const std::filesystem::path& folder, const Manifest& manifest);

/// Names of existing assets that the folder's earlier manifest lists and no job makes any more.
[[nodiscard]] std::vector<std::string> left_over(const std::filesystem::path& folder, const std::vector<Job>& jobs);

}  // namespace vps::cli::batch

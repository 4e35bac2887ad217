// SPDX-License-Identifier: GPL-3.0-or-later
/// @file From folders, files and lists to bakes.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

struct Inputs {
  std::vector<std::string> paths;             ///< folders, meshes, and lists that end in .toml
  std::filesystem::path folder;               ///< of the assets
  OptionTexts options;                        ///< where no vpsbake.toml says otherwise
  std::vector<std::string> include, exclude;  ///< globs, from each folder of `paths`; an empty `include`: all
};

/// For the log of a batch, and back. Paths stay as they are.
[[nodiscard]] nlohmann::ordered_json to_json(const Inputs& inputs);
[[nodiscard]] Inputs inputs_from(const nlohmann::ordered_json& json);

/// Every mesh below the folders, in the order of their assets' names. Folders are searched downwards, each with its
/// vpsbake.toml, hidden ones and `folder` left out. What is wrong with one mesh, such as two that would be written to
/// one asset, is its refusal.
/// @param settings  takes the vpsbake.toml files and lists that were read, unless it is null
/// @throw BatchError when an input is not there, a vpsbake.toml cannot be used, or there is no mesh at all
[[nodiscard]] std::vector<Job> find_jobs(const Inputs& inputs, const OptionReader& reader,
                                         std::vector<std::filesystem::path>* settings = nullptr);

}  // namespace vps::cli::batch

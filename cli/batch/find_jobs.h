// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Finds the bakes for folders, files and lists.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

struct Inputs {
  std::vector<std::string> paths;  ///< folders, meshes, and lists that end in .toml
  std::filesystem::path folder;    ///< for the assets
  OptionTexts options;             ///< used wherever no vpsbake.toml overrides them
  std::vector<std::string> include,
      exclude;  ///< globs, relative to each folder of `paths`; an empty `include` means all
};

/// Writes the inputs for the log of a batch, and reads them back. Paths stay as they are.
[[nodiscard]] nlohmann::ordered_json to_json(const Inputs& inputs);
[[nodiscard]] Inputs inputs_from(const nlohmann::ordered_json& json);

/// Finds every mesh of the inputs, ordered by their assets' names. Folders are searched recursively, each with its
/// vpsbake.toml. Hidden files and folders, links to folders and `folder` are left out. A problem of one mesh, such as
/// an asset's name that another mesh has too, becomes its job's refusal.
/// @param settings  takes the vpsbake.toml files and lists that were read; may be null
/// @throw BatchError when an input does not exist, a vpsbake.toml cannot be used, or there is no mesh at all
[[nodiscard]] std::vector<Job> find_jobs(const Inputs& inputs, const OptionReader& reader,
                                         std::vector<std::filesystem::path>* settings = nullptr);

}  // namespace vps::cli::batch

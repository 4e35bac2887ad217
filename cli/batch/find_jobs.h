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

/// What was read for the settings.
struct SettingsRead {
  struct IdleGlob {
    std::filesystem::path file;
    std::string glob;
  };
  std::vector<std::filesystem::path> files;  ///< vpsbake.toml and lists
  /// Globs of the inputs that match nothing, and, unless the inputs choose some of the meshes, those of [[files]] that
  /// match no mesh of their folder.
  std::vector<IdleGlob> idle;
};

/// Finds every mesh of the inputs, ordered by their assets' names. Folders are searched recursively, each with its
/// vpsbake.toml. Hidden files and folders, links to folders and `folder` are left out. A problem of one mesh, such as
/// an asset's name that another mesh has too, becomes its job's refusal.
/// @param read  takes what was read for the settings; may be null
/// @throw BatchError when an input does not exist, a vpsbake.toml cannot be used, or there is no mesh at all
[[nodiscard]] std::vector<Job> find_jobs(const Inputs& inputs, const OptionReader& reader,
                                         SettingsRead* read = nullptr);

}  // namespace vps::cli::batch

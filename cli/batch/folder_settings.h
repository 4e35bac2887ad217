// SPDX-License-Identifier: GPL-3.0-or-later
/// @file vpsbake.toml: settings beside the meshes, and lists of meshes. docs/batch.md has the keys.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/batch/job.h"

namespace vps::cli::batch {

/// An entry of [[files]].
struct FileSettings {
  std::vector<std::string> match;  ///< globs, compared with the path from the file's folder; in a list: empty
  std::string mesh;                ///< in a list: the mesh, from the list's folder
  OptionTexts options;
  std::string output;  ///< instead of the mesh's name; empty: none
  std::optional<bool> skip;
};

struct FolderSettings {
  OptionTexts options;
  std::vector<std::string> include, exclude;  ///< globs
  std::vector<FileSettings> files;            ///< a later one wins
};

enum class SettingsKind { beside_meshes, list };

/// @throw BatchError that names the line
[[nodiscard]] FolderSettings read_folder_settings(const std::filesystem::path& file, SettingsKind kind,
                                                  const OptionReader& reader);

/// Whether a glob means a path, both with slashes. One without a slash is compared with the last name and with each
/// folder's, one with a slash with the whole path; a star stands for anything, slashes too.
[[nodiscard]] bool glob_matches(const std::string& glob, const std::string& path);

}  // namespace vps::cli::batch

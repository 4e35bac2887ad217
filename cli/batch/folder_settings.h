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
  std::vector<std::string> match;  ///< globs, compared with paths relative to the file's folder; in a list: empty
  std::string mesh;                ///< in a list: the mesh, relative to the list's folder
  OptionTexts options;
  std::string output;  ///< the asset's path; empty: from the mesh's name
  std::optional<bool> skip;
};

struct FolderSettings {
  OptionTexts options;
  std::vector<std::string> include, exclude;  ///< globs
  std::vector<FileSettings> files;            ///< a later entry overrides earlier ones
};

enum class SettingsKind { beside_meshes, list };

/// @throw BatchError with the line
[[nodiscard]] FolderSettings read_folder_settings(const std::filesystem::path& file, SettingsKind kind,
                                                  const OptionReader& reader);

/// Whether a glob matches a path, both with slashes. A glob without a slash is compared with each name in the path, the
/// folders' and the file's. A glob with a slash is compared with the whole path. A star matches any text, slashes too.
[[nodiscard]] bool glob_matches(const std::string& glob, const std::string& path);

}  // namespace vps::cli::batch

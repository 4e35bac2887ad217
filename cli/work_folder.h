// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A folder for files that nobody needs afterwards.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace vps::cli {

/// Below TMPDIR, gone with the object.
class WorkFolder {
 public:
  /// @throw std::filesystem::filesystem_error
  WorkFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "vpsbake_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) {
      throw std::filesystem::filesystem_error("mkdtemp", name, std::error_code(errno, std::generic_category()));
    }
    path_ = name;
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace vps::cli

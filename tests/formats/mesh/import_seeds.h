// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One small valid file of each mesh format, to be damaged by tests.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vps::test {

struct Seed {
  std::string name;       ///< of the format, for tables
  std::string extension;  ///< with the dot
  std::string bytes;      ///< the same at any time, on any machine
};

/// Writes a sample mesh with assimp's exporter, and by hand the formats that assimp does not write.
/// @param folder  receives the files and the files that they refer to
[[nodiscard]] std::vector<Seed> make_seeds(const std::filesystem::path& folder);

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads a file with assimp into raw bytes. Runs in the child process only. Internal to mesh import.
#pragma once

#include <cstdint>
#include <string>

namespace vps {

/// What the child writes first. Then, without error, `vertices` times 3 doubles and `triangles` times 3 u32; with an
/// error, its text up to the end.
struct RawMeshHeader {
  static constexpr std::uint32_t kMesh = 0x4853454D;
  static constexpr std::uint32_t kError = 0x20525245;
  std::uint32_t tag = 0;
  std::uint32_t skipped_primitives = 0;  ///< points and lines
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};

/// Imports `path` with the loaders for `extension` only, walks the node tree with its transforms, triangulates, and
/// writes the result to `fd`.
/// @param extension  in lower case, without the dot
void read_with_assimp(const std::string& path, const std::string& extension, int fd);

}  // namespace vps

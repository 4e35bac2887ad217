// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the child process of mesh import writes for its parent. Internal to mesh import.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace vps {

/// What the child writes first. For a mesh, `vertices` times 3 doubles, `triangles` times 3 u32 and `note_bytes` of
/// text follow. For an error, its text follows up to the end.
struct RawMeshHeader {
  static constexpr std::uint32_t kMesh = 0x4853454D;
  static constexpr std::uint32_t kError = 0x20525245;
  std::uint32_t tag = 0;
  std::uint32_t note_bytes = 0;
  std::uint64_t skipped_primitives = 0;  ///< points and lines
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
};

struct RawMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint64_t skipped_primitives = 0;
  std::string note;  ///< what the caller should know; empty: nothing
};

/// The same, held elsewhere.
struct RawMeshView {
  std::span<const std::array<double, 3>> vertices;
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::uint64_t skipped_primitives = 0;
  std::string note;
};

/// A file that cannot be read correctly. `what()` is the reason, without advice.
struct ReadError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The bytes of a file. @throw ReadError
[[nodiscard]] std::string read_bytes(const std::string& path);

void send_mesh(int fd, const RawMesh& raw);
void send_error(int fd, const std::string& text);

}  // namespace vps

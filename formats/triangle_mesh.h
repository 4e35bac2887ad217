// SPDX-License-Identifier: Zlib
/// @file An indexed triangle mesh, the input of baking.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace vps {

/// Triangles are wound counter-clockwise seen from outside. Positions in metres, the mesh's own frame.
struct TriangleMesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace vps

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Positions and polygons as a file has them. Internal to mesh import.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "formats/mesh/raw_mesh.h"

namespace vps {

struct PolygonSoup {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::vector<std::size_t>> polygons;  ///< numbers of vertices, which may not be there
  std::uint64_t skipped_primitives = 0;            ///< points and lines
};

/// Cuts polygons into triangles. @throw ReadError when a polygon's vertex is not there
[[nodiscard]] RawMesh to_raw_mesh(PolygonSoup&& soup);

}  // namespace vps

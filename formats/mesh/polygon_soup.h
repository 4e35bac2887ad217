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
  std::vector<std::size_t> corners;      ///< of all polygons: numbers of vertices, which may not be there
  std::vector<std::size_t> ends;         ///< of each polygon among `corners`
  std::uint64_t skipped_primitives = 0;  ///< points and lines

  /// The corners since the last call are a polygon.
  void end_polygon() { ends.push_back(corners.size()); }
  /// Most corners of a polygon.
  [[nodiscard]] std::size_t most_corners() const;
};

/// Cuts polygons into triangles. @throw ReadError when a polygon's vertex is not there
[[nodiscard]] RawMesh to_raw_mesh(PolygonSoup&& soup);

}  // namespace vps

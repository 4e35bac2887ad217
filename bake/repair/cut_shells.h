// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Cuts triangles along their intersections, in exact arithmetic. Internal to bake.
#pragma once

#include <unordered_map>

#include "bake/repair/self_intersections.h"

namespace vps::bake {

/// Per triangle: others that meet it in its plane, in rising order. Triangles without any are left out.
using Coplanar = std::unordered_map<std::uint32_t, std::vector<std::uint32_t>>;

/// All triangles of a mesh, cut where others meet them.
struct CutShells {
  Mesh pieces;                         ///< in the order of their triangles, wound like them, on joined vertices
  std::vector<std::uint32_t> origins;  ///< per piece: the triangle that it was cut from
  /// Pieces of one triangle between which no cut lies: enough pairs to connect them all.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> neighbours;
  std::vector<std::uint8_t> whole;  ///< one byte per triangle: 1 for one that has an area and is not cut
  Coplanar coplanar;
};

/// New vertices are evaluated exactly, then rounded to double. Vertices at one position are joined. Pieces that
/// collapse by this are left out. Triangles without area are not cut.
/// @param pairs  all self-intersections of the mesh
[[nodiscard]] CutShells cut_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs);

}  // namespace vps::bake

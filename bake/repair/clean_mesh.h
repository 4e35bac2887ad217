// SPDX-License-Identifier: GPL-3.0-or-later
/// @file First step of the mesh check: one vertex per position, no collapsed or repeated triangles. Internal to bake.
#pragma once

#include "bake/geometry.h"
#include "formats/triangle_mesh.h"

namespace vps::bake {

struct CleanCounts {
  std::size_t collapsed = 0;   ///< triangles that used a position twice
  std::size_t duplicates = 0;  ///< triangles dropped because others lie on the same three vertices
};

/// Joins identical positions (-0 is 0) and drops unused vertices and collapsed triangles.
/// @pre measure_extent accepts the mesh
[[nodiscard]] Mesh join_vertices(const TriangleMesh& mesh, CleanCounts& counts);

/// Keeps one of the triangles on the same three vertices. Where as many face one way as the other, keeps one if that
/// closes more edges than it opens, as of a surface drawn from both sides. Else keeps none: they are a wall between two
/// solids, or a fin.
void drop_duplicates(Mesh& mesh, CleanCounts& counts);

/// Drops triangles that use a vertex twice. @return their number
std::size_t drop_collapsed(Mesh& mesh);

}  // namespace vps::bake

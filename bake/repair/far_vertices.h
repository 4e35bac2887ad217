// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Finds vertices that are far from the rest of a mesh, as faulty exports leave them. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

struct FarVertices {
  std::size_t count = 0;
  double core = 0;                ///< longest side of the box around all others. [m]
  double distance = 0;            ///< largest distance of one from that box, along an axis. [m]
  Vector place = Vector::Zero();  ///< of that one. [m]
};

/// Vertices outside of the box that holds 98 % of the vertices, if this box is less than a thousandth of the mesh's and
/// fits into one voxel. Only those that triangles join to the box count: a rod beside a small screw has other
/// triangles. Where the box is so small that no grid can hold both, all of them count.
/// @param voxel_size  0: unknown. [m]
[[nodiscard]] FarVertices find_far_vertices(const Mesh& mesh, double voxel_size);

}  // namespace vps::bake

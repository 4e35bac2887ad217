// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The outer boundary of shells that overlap or cross themselves. Internal to bake.
#pragma once

#include "bake/repair/self_intersections.h"

namespace vps::bake {

struct UnitedShells {
  Mesh mesh;
  int least_winding = 0;  ///< below 0: some part of the input was inside out
};

/// Boundary of the points with a winding number above 0. Triangles are cut along their intersections in exact
/// arithmetic. Then each piece is kept or dropped as a whole. New vertices are rounded to double.
/// @param pairs  all self-intersections of the mesh
/// @pre every edge is balanced
[[nodiscard]] UnitedShells unite_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The outer boundary of shells that overlap or cross themselves. Internal to bake.
#pragma once

#include "bake/repair/self_intersections.h"

namespace vps::bake {

struct UnitedShells {
  Mesh mesh;
  bool righted = false;  ///< the inward shells were turned
};

/// Boundary of the points with a winding number above 0. Triangles are cut along their intersections in exact
/// arithmetic. Then each piece is kept or dropped as a whole. New vertices are rounded to double.
/// Inward shells are turned first if there are no others, or if some winding number would be negative otherwise.
/// @param pairs   all self-intersections of the mesh
/// @param inward  one byte per triangle: 1 for shells of negative volume
/// @pre every edge is balanced
[[nodiscard]] UnitedShells unite_shells(const Mesh& mesh, const std::vector<TrianglePair>& pairs,
                                        const std::vector<std::uint8_t>& inward);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Flat facets for a point's part of the surface where that is folded or strongly curved. Beyond the paper: its
/// sums (Eqs. 2 and 3) give a point one normal. Internal to bake.
#pragma once

#include <array>
#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

/// A convex part of a point's cell, on one triangle.
struct CellPart {
  Vector normal;                ///< outward, unit
  std::vector<Vector> corners;  ///< counter-clockwise seen from outside, relative to the point. [m]
};

/// A flat quadrilateral; a triangle repeats its last corner. Counter-clockwise seen from outside, relative to the
/// point. [m]
using Facet = std::array<Vector, 4>;

/// One facet for each side of the cell, with the side's vector area and centroid, and about its shape.
[[nodiscard]] std::vector<Facet> fit_facets(std::vector<CellPart> cell);

}  // namespace vps::bake

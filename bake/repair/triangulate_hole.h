// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Triangles that span a closed polyline. Internal to bake.
#pragma once

#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

/// @param border  at least 3 points
/// @return triangles on the border's points, in the border's direction; empty when CGAL finds none
[[nodiscard]] std::vector<Triangle> triangulate_hole(const std::vector<Vector>& border);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Cuts a polygon into triangles. Internal to mesh import.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vps {

/// Ear clipping in the plane of the polygon's Newell normal. Concave polygons are cut rightly; of self-crossing or
/// degenerate ones every corner is still used, so that the number of triangles is always n - 2.
/// @param corners  positions of the polygon's corners in order; n >= 3
/// @return triangles of corner numbers, wound like the polygon
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(
    std::span<const std::array<double, 3>> corners);

}  // namespace vps

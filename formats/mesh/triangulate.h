// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Cuts a polygon into triangles. Internal to mesh import.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace vps {

/// Ear clipping in the plane of the polygon's Newell normal. Concave polygons, and polygons that touch themselves
/// (holes joined to the outline by a bridge), are cut correctly. A corner equal to the one before it is dropped. Every
/// other corner is used, also in self-crossing or flat polygons, so that neighbouring faces stay joined. Always ends.
/// @param corners  positions of the polygon's n corners in order
/// @return at most n - 2 triangles of corner numbers, wound like the polygon; none when fewer than 3 corners differ
///         from the one before. A triangle (n = 3) is passed through as it is.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(
    std::span<const std::array<double, 3>> corners);

}  // namespace vps

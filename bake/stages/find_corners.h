// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Convex corners and tips, sharp or rounded: they may go between the points of a face that they meet.
/// Internal to bake.
#pragma once

#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

/// Sharpness: how far the normals around a place turn to the side of their mean, squared, in the direction in which
/// they do so least. 0 on planes, edges and along cylinders, 1/3 at a cube's corner, cos^2(a) / 2 at the tip of a cone
/// with half-angle a. Corners have more than this: cones of up to 127 degrees.
inline constexpr double kCorner = 0.1;

struct Corner {
  Vector place;  ///< [m]
  std::uint32_t triangle = 0;
  double sharpness = 0;
};

/// The convex corners among the mesh's vertices, in their order; then those that the mesh rounds off with radii below
/// two voxels, the sharpest first, at least two voxels from each other and from the former. A rounded corner is as
/// sharp as all vertices within two voxels together.
/// @param voxel_size  [m]
[[nodiscard]] std::vector<Corner> find_corners(const Surface& surface, double voxel_size);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Surface voxels, v = 0. Paper: Sec. 2.1.1. Internal to bake.
#pragma once

#include "bake/grid.h"

namespace vps::bake {

/// Every voxel (closed cube) that a triangle touches. Memory grows with the surface, plus 4 bytes per brick of the
/// grid.
struct SurfaceVoxels {
  BrickSet set;
  std::vector<BrickMask> masks;  ///< one per brick of the set
  std::uint64_t count = 0;

  [[nodiscard]] bool test(const Grid& grid, std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    const std::uint32_t brick = set.index[grid.brick_of_voxel(i, j, k)];
    return brick != kNoBrick && test_bit(masks[brick], voxel_in_brick(i, j, k));
  }
};

/// First and last voxel along one axis that the closed interval [low, high], widened by `slack`, touches. Touching
/// faces count. [Units: m in, vx out]. Clamped to the grid.
struct VoxelRange {
  std::uint32_t first, last;
};
[[nodiscard]] VoxelRange voxel_range(const Grid& grid, int axis, double low, double high, double slack);

/// Separating Axis Theorem for a triangle and an axis-aligned cube [AM05]. Conservative: rounding and touching count as
/// overlap, so no touched voxel is missed.
[[nodiscard]] bool triangle_touches_cube(const Vector& centre, double half_edge, const Vector& a, const Vector& b,
                                         const Vector& c, double slack);

[[nodiscard]] SurfaceVoxels voxelize(const Surface& surface, const Grid& grid);

/// Bound of the rounding error of coordinates in this grid. [m]
[[nodiscard]] double rounding_slack(const Grid& grid);

}  // namespace vps::bake

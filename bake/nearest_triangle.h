// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The innermost loop of the distance field, vectorized. Internal to bake.
#pragma once

#include <array>

#include "bake/grid.h"

namespace vps {

/// The nearest triangle of each voxel of a brick so far.
struct NearestTriangles {
  alignas(64) std::array<double, kBrickVoxels> squared;  ///< distance. [m^2]
  /// Number as double: lanes of one width. Negative: none yet.
  alignas(64) std::array<double, kBrickVoxels> triangle;
};

/// Offers triangle `t` to the voxel centres of a brick that may lie within `band` of it. The nearer triangle stays, and
/// among equals the earlier one. Results do not depend on the machine's vector instructions: every operation is rounded
/// by itself.
void offer_triangle(const Surface& surface, std::size_t t, const Grid& grid, const Index3& brick, double band,
                    NearestTriangles& nearest);

}  // namespace vps

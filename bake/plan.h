// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Chooses the grid before any work is done, and refuses absurd grids. Internal to bake.
#pragma once

#include "bake/extent.h"
#include "bake/grid.h"
#include "bake/stage_times.h"
#include "bake/vps_bake.h"

namespace vps::bake {

/// Most nodes of the far grid for each voxel on the surface: 4 % of a usual asset, of 10.5 bytes for each.
inline constexpr double kFarNodes = 0.45;

/// Of a file for each point: its codes and its share of the tree.
inline constexpr double kPointBytes = 10 + 16.0 / 12;

struct GridPlan {
  Grid grid;
  int precision = 0;  ///< p of Eq. (1), or kAutoPrecision
  double lambda = 0;  ///< step of the scaled field. [m]
  BakePlan plan;
  BakeSize size;
};

[[nodiscard]] Extent extent_of(const Surface& surface, const Creases& creases);

/// @throw BakeError when an option is out of range, or options exclude each other
void check_options(const BakeOptions& options);

/// @throw BakeError when check_options does, or when the grid does not suit the mesh
[[nodiscard]] GridPlan plan_grid(const Extent& mesh, const BakeOptions& options);

/// Largest absolute value that `scaled` may hold: 127 or 32767. Larger than both when the band does not fit 16 bits.
[[nodiscard]] std::int32_t scaled_limit(const BakeOptions& options, double voxel_size, double lambda);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A bound of the distance to the surface for each brick. Internal to bake.
#pragma once

#include "bake/stages/fill_layers.h"

namespace vps::bake {

/// For each brick of the grid, a lower bound of the distance from its centre to the surface, in whole voxels. It is
/// less than three voxels below the distance. Where the brick holds no surface, it has the layer's sign. Paper: the
/// layered voxelmap, kept at brick resolution. [Units: vx]
///
/// Computes exact distances to the centres of the surface voxels, by lower envelopes of parabolas axis after axis
/// (Felzenszwalb and Huttenlocher 2012). Subtracts half a voxel's diagonal, because every point of the surface is that
/// close to such a centre.
[[nodiscard]] std::vector<std::int16_t> coarse_layers(const Grid& grid, const SurfaceVoxels& voxels,
                                                      const InsideRuns& runs);

}  // namespace vps::bake

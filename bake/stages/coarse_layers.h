// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A bound of the distance for each brick far from the surface. Internal to bake.
#pragma once

#include "bake/stages/fill_layers.h"

namespace vps::bake {

/// For each brick of the grid a lower bound of the distance of its centre to the surface in whole voxels, less than
/// three voxels below it; where the brick holds no surface, with the layer's sign. Paper: the layered voxelmap, kept at
/// brick resolution. [Units: vx]
///
/// Exact distances to the centres of the surface voxels, by lower envelopes of parabolas axis after axis (Felzenszwalb
/// and Huttenlocher 2012), less half a voxel's diagonal: every point of the surface is that close to such a centre.
[[nodiscard]] std::vector<std::int16_t> coarse_layers(const Grid& grid, const SurfaceVoxels& voxels,
                                                      const InsideRuns& runs);

}  // namespace vps::bake

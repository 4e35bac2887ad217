// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bounds of the distance to the surface for a coarse grid of blocks. Internal to bake.
#pragma once

#include "bake/stages/fill_layers.h"

namespace vps::bake {

/// For each block of the grid, a lower bound of the distance from its centre to the surface, in whole voxels. It is
/// less than three voxels below the distance. Where the block holds no surface, it has the layer's sign. Paper: the
/// layered voxelmap, kept at a coarse resolution. [Units: vx]
///
/// Computes exact distances to the centres of the surface voxels, axis after axis (Felzenszwalb and Huttenlocher 2012,
/// but with a search outwards along each line, for several lines at once). Subtracts half a voxel's diagonal, because
/// every point of the surface is that close to such a centre.
/// @param edge  of a block: kBrickEdge or kCoarseEdge. The last blocks may reach beyond the grid. [vx]
[[nodiscard]] std::vector<std::int16_t> coarse_layers(const Grid& grid, const SurfaceVoxels& voxels,
                                                      const InsideRuns& runs, std::uint32_t edge);

}  // namespace vps::bake

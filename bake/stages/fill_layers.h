// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Inside and outside by scanlines, and the layers v = +-n. Paper: Sec. 2.1.1. Internal to bake.
#pragma once

#include "bake/stages/voxelize.h"

namespace vps::bake {

/// Runs of voxels along x whose centres are inside (winding number > 0, surface included). Memory grows with the
/// surface.
struct InsideRuns {
  std::vector<std::uint32_t> line_start;  ///< per line (k * ny + j): first entry in `bounds`; one more at the end
  std::vector<std::uint32_t> bounds;      ///< pairs: first voxel inside, first voxel outside again
  std::uint64_t count = 0;                ///< voxels inside

  [[nodiscard]] bool test(const Grid& grid, std::uint32_t i, std::uint32_t j, std::uint32_t k) const;
};

/// Scanline fill. Exact for every voxel centre of a closed surface; overlapping shells are united, shells of opposite
/// winding are cavities.
/// @throw BakeError with the place of the leak when a line does not leave the solid again.
[[nodiscard]] InsideRuns fill_inside(const Surface& surface, const Grid& grid);

/// Inside bits of each brick of a set.
[[nodiscard]] std::vector<BrickMask> inside_masks(const InsideRuns& runs, const Grid& grid, const BrickSet& set);

/// Layer of every voxel of the bricks of a set: Chebyshev distance to the nearest surface voxel in voxels, signed.
/// Bound: a voxel of layer n != 0 has every point at least (|n| - 1) s and at most sqrt(3) (|n| + 1) s from the
/// surface.
/// @pre every voxel of the set lies within 2 * kBrickEdge voxels of a surface voxel, as in a narrow band of <= 8
/// voxels.
[[nodiscard]] std::vector<std::int8_t> fill_layers(const SurfaceVoxels& surface, const std::vector<BrickMask>& inside,
                                                   const Grid& grid, const BrickSet& set);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The same asset read in another way than its queries do: without interpolation as the paper has it, or with it
/// where queries have none. Slow: every point is asked, so that answers have no time that would mean anything.
#pragma once

#include <cstdint>
#include <memory>

#include "cli/lab/pair.h"

namespace vps::lab {

/// How V at a point comes from stored numbers. Paper: Sec. 2.2.
enum class Reading : std::uint8_t {
  queries,   ///< as queries do: layers by Eq. (4), the others between the eight samples round the point
  nearest,   ///< from the nearest sample alone: scaled along the shell's normal, Eq. (4); real along its gradient, Eq.
             ///< (5)
  trilinear  ///< layers between the centres of the eight voxels round the point, times the voxel size
};

/// V(P) at a point, map frame. Where a reading has no samples, as beyond the band, what queries say. [m]
[[nodiscard]] double read_penetration(const VoxelmapView& map, Reading reading, Vec3 point, Vec3 inward_normal);

/// All points of the asset's pointshell against its voxelmap.
/// @throw std::runtime_error when the asset lacks one of them
[[nodiscard]] std::unique_ptr<PairPeer> read_otherwise(std::shared_ptr<const Asset> asset, Reading reading);

}  // namespace vps::lab

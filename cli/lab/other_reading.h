// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads an asset's field otherwise than queries do: without interpolation, as in the paper, or with
/// interpolation where queries have none. Slow, since it tests every point: its answers have no times.
#pragma once

#include <cstdint>
#include <memory>

#include "cli/lab/pair.h"

namespace vps::lab {

/// How V at a point is computed from the stored field. Paper: Sec. 2.2.
enum class Reading : std::uint8_t {
  queries,   ///< as queries do: layers by Eq. (4), the others interpolated between the eight samples round the point
  nearest,   ///< from the nearest sample alone: scaled along the shell's normal, Eq. (4); real along its gradient, Eq.
             ///< (5)
  trilinear  ///< layers between the centres of the eight voxels round the point, times the voxel size
};

/// V(P) at a point, map frame. Where a reading has no samples, as beyond the band, the value that queries use. [m]
[[nodiscard]] double read_penetration(const VoxelmapView& map, Reading reading, Vec3 point, Vec3 inward_normal);

/// Tests all points of the asset's pointshell against its voxelmap.
/// @throw std::runtime_error when the asset has no pointshell or no voxelmap
[[nodiscard]] std::unique_ptr<PairPeer> read_otherwise(std::shared_ptr<const Asset> asset, Reading reading);

}  // namespace vps::lab

// SPDX-License-Identifier: Zlib
/// @file Whether all samples of a brick follow a linear function, or lie below it: the inner loops of
/// is_linear_between and is_plane_within. Internal.
#pragma once

#include <array>

#include "formats/octree.h"
#include "runtime/vps_runtime.h"

namespace vps::detail {

/// What the bricks of one level are compared with: a linear function, near a plane.
struct BrickTest {
  float step = 0;       ///< takes the samples' codes to V. [m]
  float tolerance = 0;  ///< of V. [m]
  float near = 0;       ///< largest height above the plane of the samples that count. [vx]
  /// Changes from sample to sample along the axes: of the wanted V [m], and of the height above the plane [vx].
  float wanted[3] = {}, height[3] = {};

  /// Changes from the first sample to each, in the order of the samples where slices follow each other along an axis.
  struct Rows {
    alignas(64) float wanted[kFieldSamples];
    alignas(64) float height[kFieldSamples];
    float lowest, highest;  ///< changes of the height from a slice's first sample to the others
  };
  bool has_rows[3] = {};
  std::array<Rows, 3> rows;  ///< by that axis
};

/// Whether |V - wanted| <= tolerance at every sample of a brick near the plane. Where rounding would decide it is
/// false.
/// @param entry   of the brick
/// @param wanted  V at the first sample. [m]
/// @param height  of the first sample above the plane. [vx]
bool is_linear_brick(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted,
                     float height) noexcept;

/// Whether V <= max(wanted, floor) + tolerance at every sample of a brick.
/// @param test    its heights are not used
/// @param wanted  as above
/// @param floor   [m]
bool is_brick_below(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted, float floor) noexcept;

}  // namespace vps::detail

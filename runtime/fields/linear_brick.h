// SPDX-License-Identifier: Zlib
/// @file Whether all samples of a brick follow a linear function: the inner loop of is_linear_between. Internal.
#pragma once

#include <cstddef>

#include "formats/octree.h"
#include "runtime/vps_runtime.h"

namespace vps::detail {

/// A linear function of the place over the samples of a brick.
struct LineOverBrick {
  float first = 0;   ///< at the first sample
  float slope[3]{};  ///< from sample to sample, along the axes
};

/// Slices of a brick that are not stored.
struct LeftOut {
  float count = 0;
  bool is_lower = false;  ///< they lie below those that are stored, else above
  bool are_far = true;    ///< no sample of theirs counts
};

/// Whether |V - wanted| <= tolerance at every sample of a brick near a plane. Where rounding would decide it is false.
/// @param entry   of the brick
/// @param step    takes the samples' codes to V. [m]
/// @param wanted  [m]
/// @param height  above the plane. [vx]
/// @param near    largest height of the samples that count. [vx]
bool is_linear_brick(const VoxelmapView& map, std::uint32_t entry, float step, const LineOverBrick& wanted,
                     float tolerance, const LineOverBrick& height, float near) noexcept;

}  // namespace vps::detail

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Tests in float whether a brick's interpolation is good enough in an octant. Internal to bake.
#pragma once

#include <array>
#include <cmath>
#include <functional>

#include "bake/stages/float_distances.h"
#include "bake/stages/sample_field.h"

namespace vps::bake {

inline const double kHalfDiagonal = std::sqrt(0.75);  ///< of a cube whose edge is 1

/// In the band's last half diagonal of a voxel the allowed error grows by this much per length.
inline constexpr double kErrorGrowth = 0.25;

/// What is known of the brick of half the size in an octant. Lengths are in voxels.
struct OctantTrial {
  std::array<float, 27> value;      ///< exact penetrations at the coarse brick's samples, x fastest
  std::array<float, 27> fitted;     ///< what it interpolates between
  std::array<float, 128> distance;  ///< of the fine brick's samples, in its order
  float error = 0;                  ///< bound of the distances' error
  float reach = 0;                  ///< distances count as at most this
  float step = 0;                   ///< between the fine brick's samples
};

/// Whether interpolation is good enough at all samples that only the fine brick has. False where rounding leaves a
/// doubt.
/// @param is_inside  on which side of the surface a sample lies; only asked where distances do not show it
[[nodiscard]] bool surely_interpolates(const OctantTrial& trial, const FieldTolerance& tolerance_vx,
                                       const std::function<bool(std::size_t)>& is_inside);

}  // namespace vps::bake

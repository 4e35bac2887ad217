// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How long the stages of a bake will take, for its progress. Internal to bake.
#pragma once

#include <string_view>

namespace vps::bake {

/// What the times of stages grow with, known from the plan.
struct BakeSize {
  double triangles = 0;
  double area = 0;          ///< of the surface, in squares of a voxel's edge
  double field_bricks = 0;  ///< estimate; 0 without a field
  double points = 0;        ///< estimate; 0 without a pointshell
};

/// The ratios of these times are the weights of the stages; a slower machine scales them all. [s]
[[nodiscard]] double expected_seconds(std::string_view stage, const BakeSize& size);

}  // namespace vps::bake

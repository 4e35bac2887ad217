// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Makes the field continuous where field bricks of different levels meet. Internal to bake.
#pragma once

#include <cstdint>
#include <span>

#include "bake/stages/sample_field.h"

namespace vps::bake {

/// Sets a brick's samples on faces, edges and corners of larger-celled bricks to what those interpolate there. Samples
/// beyond the band stay as they are, and those in its last half diagonal of a voxel that would change by more than the
/// allowed error.
/// @param samples  [f,128], fitted. [m]
void close_faces(const FieldTree& tree, const FieldTolerance& tolerance, double voxel_size, std::span<double> samples);

struct RoundedSamples {
  std::span<std::int16_t> samples;  ///< [f,128], in steps
  std::span<const double> steps;    ///< [f]. [m]
  std::int32_t limit = 0;           ///< largest absolute value of a sample
};
/// The same for rounded samples: they are rounded again.
void close_faces(const FieldTree& tree, const FieldTolerance& tolerance, double voxel_size, RoundedSamples rounded);

}  // namespace vps::bake

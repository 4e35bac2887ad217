// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Moves the stored samples of a brick so that interpolation between them errs less. Internal to bake.
#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "formats/octree.h"

namespace vps::bake {

/// What is known at the samples of the bricks of half the size, x fastest. [m]
struct FineSamples {
  static constexpr int kEdge = 2 * static_cast<int>(kFieldEdge) - 1;
  static constexpr std::size_t kCount = std::size_t{kEdge} * kEdge * kEdge;
  static constexpr double kUnknown = -1;
  static constexpr double kAnyError = std::numeric_limits<double>::infinity();

  std::array<double, kCount> value;  ///< exact penetration
  std::array<double, kCount> limit;  ///< allowed error, or kAnyError, or kUnknown

  FineSamples() { limit.fill(kUnknown); }

  /// The number of a sample of the brick of half the size in an octant.
  static constexpr std::size_t at(int octant, int sample) {
    constexpr auto kBrick = static_cast<int>(kFieldEdge);
    const int x = (octant & 1) * (kBrick - 1) + sample % kBrick;
    const int y = (octant >> 1 & 1) * (kBrick - 1) + sample / kBrick % kBrick;
    const int z = (octant >> 2) * (kBrick - 1) + sample / (kBrick * kBrick);
    return static_cast<std::size_t>((z * kEdge + y) * kEdge + x);
  }
};

using BrickValues = std::array<double, std::size_t{kFieldEdge} * kFieldEdge * kFieldEdge>;

/// Moves samples so that the errors around them are as large upwards as downwards, where interpolation is not yet good
/// enough at all fine samples. Samples next to unknown ones stay, and so do those within a step of the surface: there,
/// contacts need a field without jumps between bricks.
/// @param value     exact penetrations at the samples [m]
/// @param step      from one sample to the next [m]
/// @param farthest  a stored sample may be this far from the exact one, on the same side of the surface [m]
/// @param fitted    the stored ones [m]
/// @return whether a sample moved
bool fit_samples(const FineSamples& fine, const BrickValues& value, double step, double farthest, BrickValues& fitted);

}  // namespace vps::bake

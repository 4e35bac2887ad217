// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How far the places of a piece of the surface are from the samples. Vectorized. Internal to bake.
#pragma once

#include <array>
#include <span>

#include "bake/stages/near_samples.h"

namespace vps::bake {

/// Whether all of a piece is surely nearer to one of the samples than `limit`. Many pieces that are nearer fail.
/// @param edges  squared lengths, from corner 0 to 1, 1 to 2 and 2 to 0. [m^2]
/// @param limit  squared. [m^2]
[[nodiscard]] bool surely_covered(std::span<const NearSamples::Found> samples, const std::array<double, 3>& edges,
                                  double limit);

}  // namespace vps::bake

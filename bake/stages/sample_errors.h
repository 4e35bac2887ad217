// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Errors of interpolation at the exact samples of a brick, against what is allowed. Vectorized. Internal to
/// bake.
#pragma once

#include <cmath>
#include <limits>

#include "bake/stages/fit_samples.h"
#include "bake/stages/octant_trial.h"

namespace vps::bake {

/// Largest error that interpolation may have, by the penetration. [m]
struct AllowedError {
  double error, band_inner, band_outer, core_inner, core_outer;

  AllowedError(const FieldTolerance& tolerance, double voxel_size)
      : error(tolerance.error),
        band_inner(tolerance.band_inner),
        band_outer(tolerance.band_outer),
        core_inner(band_inner - kHalfDiagonal * voxel_size),
        core_outer(band_outer - kHalfDiagonal * voxel_size) {}

  [[nodiscard]] double at(double penetration) const {
    const double depth = std::abs(penetration);
    const double beyond_core = depth - (penetration > 0 ? core_inner : core_outer);
    if (depth > (penetration > 0 ? band_inner : band_outer)) return std::numeric_limits<double>::infinity();
    return beyond_core > 0 ? error + kErrorGrowth * beyond_core : error;
  }
};

struct SampleErrors {
  BrickValues error;      ///< [m]
  BrickValues limit;      ///< AllowedError::at. [m]
  BrickValues spare;      ///< limit - error. [m]
  bool good = true;       ///< no error exceeds its limit
  bool hopeless = false;  ///< an error exceeds twice its limit
  bool worse = false;     ///< an error exceeds `noted`
};

/// The results are bit-identical with all vector instructions, and the limits are those of `allowed.at`.
/// @param noted  [m]
void compare_samples(const BrickValues& interpolated, const BrickValues& exact, const AllowedError& allowed,
                     double noted, SampleErrors& errors);

}  // namespace vps::bake

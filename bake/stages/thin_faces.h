// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Takes points out of faces that are flat or nearly so. Internal to bake.
#pragma once

#include <vector>

#include "bake/stages/surface_blocks.h"

namespace vps::bake {

/// Whether a sample lies inside a face: its part of the surface is flat.
[[nodiscard]] bool is_on_face(const Sample& sample);

struct Thinning {
  double most = 1;  ///< largest distance between points. [Units: spacings]
  double sag = 0;   ///< farthest that a sample which goes lies off the tangent plane of one that stays. [m]
};

/// Removes samples whose place and normal another one tells: it is near, faces the same way, and each lies in the
/// other's tangent plane. Near is at most the distance to the next edge or fold, and at most `most` spacings. Samples
/// at edges and folds stay. A sample that goes gives its area to the nearest of those that speak for it.
/// @param samples  in a fixed order; with areas
/// @return the farthest that a sample which went is from the one that has its area; 0 if all stayed. [m]
double thin_faces(std::vector<Sample*>& samples, double spacing, const Thinning& thinning);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The inward normal of a point of the shell. Paper: Sec. 2.1.2. Internal to bake.
#pragma once

#include "bake/stages/distance_field.h"
#include "bake/stages/surface_blocks.h"

namespace vps::bake {

/// The gradient of V, by central differences over one voxel; it points inward. Where it vanishes (the middle of a thin
/// wall) or contradicts the triangle, the triangle's own normal is better. Unit. [-]
[[nodiscard]] Vector inward_normal(const Grid& grid, const InsideRuns& runs, const BandField& field,
                                   const Sample& sample);

}  // namespace vps::bake

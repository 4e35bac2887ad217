// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Volume, centre of mass and inertia of a closed surface at unit density. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

struct MassProperties {
  double volume = 0;                                  ///< [m^3]
  Vector centre_of_mass = Vector::Zero();             ///< [m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass. [m^5]
};

/// Sums signed tetrahedra. Volumes where shells overlap count twice.
[[nodiscard]] MassProperties mass_properties(const Surface& surface);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses in which a body stands on a plane, on a face of its convex hull below the centre of mass.
#pragma once

#include <LinearMath/btMatrix3x3.h>
#include <LinearMath/btVector3.h>

#include <vector>

namespace vps::stress {

struct RestPose {
  btMatrix3x3 rotation;  ///< turns the face's normal to -z
  double tilt = 0;       ///< angle by which it may be tipped to any side before it falls over. [rad]
  double height = 0;     ///< of the centre of mass above the face. [m]
  double flat = 0;       ///< radius of the largest circle in the face about the foot of the centre of mass. [m]
};

/// At most `count` poses, the most stable (largest tilt) first.
/// @param corners    about the centre of mass. [m]
/// @param tolerance  corners up to this height above a face belong to it. [m]
[[nodiscard]] std::vector<RestPose> rest_poses(const std::vector<btVector3>& corners, double tolerance,
                                               std::size_t count);

}  // namespace vps::stress

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses in which a body stands on a plane: faces of its convex hull that the centre of mass lies above.
#pragma once

#include <LinearMath/btMatrix3x3.h>
#include <LinearMath/btVector3.h>

#include <vector>

namespace vps::stress {

struct RestPose {
  btMatrix3x3 rotation;  ///< turns the body such that the face looks to -z
  double tilt = 0;       ///< by which it may be tipped to any side before it falls over. [rad]
  double height = 0;     ///< of the centre of mass above the face. [m]
  double flat = 0;       ///< radius of the circle about the foot of the centre of mass that the face holds. [m]
};

/// The ones that stand best first, at most `count`.
/// @param corners    about the centre of mass. [m]
/// @param tolerance  corners that are no higher above a face belong to it. [m]
[[nodiscard]] std::vector<RestPose> rest_poses(const std::vector<btVector3>& corners, double tolerance,
                                               std::size_t count);

}  // namespace vps::stress

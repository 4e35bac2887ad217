// SPDX-License-Identifier: Zlib
/// @file Conversions between Bullet's types and the runtime's. Internal.
#pragma once

#include <LinearMath/btTransform.h>

#include "runtime/vps_runtime.h"

namespace vps::bullet {

inline Vec3 to_vec3(const btVector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}
inline btVector3 to_bt(Vec3 v) {
  return {btScalar(v.x), btScalar(v.y), btScalar(v.z)};
}

inline btTransform to_bt(const Pose& pose) {
  const auto* const r = pose.rotation;
  const auto scalar = [](double x) { return static_cast<btScalar>(x); };
  const btMatrix3x3 basis(scalar(r[0]), scalar(r[1]), scalar(r[2]), scalar(r[3]), scalar(r[4]), scalar(r[5]),
                          scalar(r[6]), scalar(r[7]), scalar(r[8]));
  return btTransform(basis, {scalar(pose.translation[0]), scalar(pose.translation[1]), scalar(pose.translation[2])});
}

/// World pose of the frame `local` of a body at `world`. Sums of translations are double, also where btScalar is not.
inline Pose to_pose(const btTransform& world, const btTransform& local) {
  const btMatrix3x3 basis = world.getBasis() * local.getBasis();
  const btVector3 moved = world.getBasis() * local.getOrigin();
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = static_cast<double>(basis[i][j]);
    pose.translation[i] = static_cast<double>(world.getOrigin()[i]) + static_cast<double>(moved[i]);
  }
  return pose;
}

inline btTransform translation(const btVector3& by) {
  return btTransform(btMatrix3x3::getIdentity(), by);
}

}  // namespace vps::bullet

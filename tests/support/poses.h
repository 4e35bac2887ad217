// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses for tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"
#include "tests/support/random.h"

namespace vps::test {

inline Pose pose_at(double x, double y, double z) {
  Pose pose;
  pose.translation[0] = x;
  pose.translation[1] = y;
  pose.translation[2] = z;
  return pose;
}

inline Pose turned_about_y(double angle) {
  Pose pose;
  pose.rotation[0] = pose.rotation[8] = std::cos(angle);
  pose.rotation[2] = std::sin(angle);
  pose.rotation[6] = -std::sin(angle);
  return pose;
}

inline Pose turned_about_x(double angle) {
  Pose pose;
  pose.rotation[4] = pose.rotation[8] = std::cos(angle);
  pose.rotation[5] = -std::sin(angle);
  pose.rotation[7] = std::sin(angle);
  return pose;
}

/// About y, then about x.
inline Pose turned_about_two_axes() {
  return relative_pose(turned_about_x(-0.5), turned_about_y(0.25));
}

inline Pose random_pose(Random& random, double distance) {
  Pose pose;
  const std::array<double, 9> rotation = random.rotation();
  std::copy(rotation.begin(), rotation.end(), pose.rotation);
  for (double& x : pose.translation) x = random.between(-distance, distance);
  return pose;
}

inline std::array<double, 3> moved(const Pose& pose, const std::array<double, 3>& p) {
  std::array<double, 3> out;
  for (std::size_t i = 0; i < 3; ++i) {
    const double* const row = pose.rotation + 3 * i;
    out[i] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + pose.translation[i];
  }
  return out;
}

inline TriangleMesh moved(const Pose& pose, TriangleMesh mesh) {
  for (auto& p : mesh.vertices) p = moved(pose, p);
  return mesh;
}

}  // namespace vps::test

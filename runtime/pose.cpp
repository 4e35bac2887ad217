// SPDX-License-Identifier: Zlib
// Rigid transforms: their check and their difference.
#include <cmath>

#include "runtime/vps_runtime.h"

namespace vps {

Status check_pose(const Pose& pose) noexcept {
  constexpr double kTolerance = 1e-3;
  constexpr double kFarthest = 1e12;  // in micrometres its square still fits a float
  const double* const r = pose.rotation;
  for (int i = 0; i < 3; ++i) {
    if (!(std::abs(pose.translation[i]) <= kFarthest)) return Status::bad_pose;
    for (int j = i; j < 3; ++j) {
      const double product = r[3 * i] * r[3 * j] + r[3 * i + 1] * r[3 * j + 1] + r[3 * i + 2] * r[3 * j + 2];
      if (!(std::abs(product - (i == j ? 1.0 : 0.0)) <= kTolerance)) return Status::bad_pose;
    }
  }
  const double determinant =
      r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
  return determinant > 0 ? Status::ok : Status::bad_pose;
}

Pose relative_pose(const Pose& first, const Pose& second) noexcept {
  Pose out;
  const double d[3] = {second.translation[0] - first.translation[0], second.translation[1] - first.translation[1],
                       second.translation[2] - first.translation[2]};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += first.rotation[3 * k + i] * second.rotation[3 * k + j];
      out.rotation[3 * i + j] = sum;
    }
    out.translation[i] = first.rotation[i] * d[0] + first.rotation[3 + i] * d[1] + first.rotation[6 + i] * d[2];
  }
  return out;
}

}  // namespace vps

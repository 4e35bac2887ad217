// SPDX-License-Identifier: Zlib
/// @file What analytic fields share with the vector kernels. Internal.
#pragma once

#include <cmath>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// The side of a cone, in its plane: r from the axis, down from the tip.
struct ConeSlant {
  float normal_r, normal_z;  ///< outward, unit: r and upwards
  float along_r, along_z;    ///< (r, down) times these: 0 at the tip, 1 at the rim
  explicit ConeSlant(const RevolvedField& cone) noexcept {
    const float height = 2 * cone.half_height;
    const float squared = cone.radius * cone.radius + height * height;
    const float size = std::sqrt(squared);
    normal_r = height / size;
    normal_z = cone.radius / size;
    along_r = cone.radius / squared;
    along_z = height / squared;
  }
};

}  // namespace vps::detail

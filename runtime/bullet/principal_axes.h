// SPDX-License-Identifier: Zlib
/// @file The axes about which a body has no products of inertia. Internal.
#pragma once

#include <LinearMath/btMatrix3x3.h>

#include <array>

namespace vps::bullet {

struct PrincipalAxes {
  btMatrix3x3 rotation;           ///< its columns are the axes: takes their frame to the tensor's
  std::array<double, 3> moments;  ///< about the axes
};

/// Of all principal axes, in any order and of either sign, those nearest to the tensor's own. A body of equal moments
/// has many; a tensor without products gives the identity.
/// @param tensor  xx, yy, zz, xy, xz, yz. [Limits: finite]
[[nodiscard]] PrincipalAxes find_principal_axes(const std::array<double, 6>& tensor);

}  // namespace vps::bullet

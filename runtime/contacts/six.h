// SPDX-License-Identifier: Zlib
/// @file Six numbers at once: force and torque, or translation and rotation. Internal to the runtime.
#pragma once

#include <array>
#include <cstddef>

namespace vps::detail {

using Six = std::array<double, 6>;

inline double dot(const Six& a, const Six& b) noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < 6; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace vps::detail

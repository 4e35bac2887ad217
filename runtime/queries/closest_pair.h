// SPDX-License-Identifier: Zlib
/// @file The closest points of two shells, by branch and bound over both point-sphere trees. Internal.
#pragma once

#include <cstdint>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps::detail {

struct ClosestPairOptions {
  float tolerance = 0;      ///< it may miss points that are closer by at most this, [m]
  float relative = 0;       ///< or by this part of the distance
  std::uint32_t guess = 0;  ///< point of the first shell that is looked at first
};

struct ClosestPair {
  std::uint32_t first = 0, second = 0;                      ///< points of the two shells
  float distance = std::numeric_limits<float>::infinity();  ///< between these. [m]
  float bound = 0;                                          ///< no two points are closer. [m]
  std::uint32_t nodes_tested = 0, points_tested = 0;
};

/// Looks first where the spheres of both trees are closest. It reads no samples: far from each other, where a field
/// says little, two shells tell within their covering radii how far apart the surfaces are.
/// @pre both shells have points
[[nodiscard]] ClosestPair find_closest_pair(const PointshellView& first, const PointshellView& second,
                                            const Pose& first_to_second, const ClosestPairOptions& options) noexcept;

}  // namespace vps::detail

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file An order in which triangles that are near each other are near in space. Internal to bake.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>

#include "bake/geometry.h"

namespace vps::bake {

/// Interleaves ten bits of each coordinate (Morton 1966).
/// @param part  [Limits: 0 <= coordinate <= 1]
[[nodiscard]] inline std::uint64_t morton_code(const Vector& part) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::uint64_t>(std::clamp(part[axis] * 1024, 0.0, 1023.0));
    for (int bit = 0; bit < 10; ++bit) code |= (cell >> bit & 1) << (3 * bit + axis);
  }
  return code;
}

/// @param low, side  of a cube around the mesh. [m]
/// @return the numbers of all triangles, by the codes of their first corners
[[nodiscard]] inline std::vector<std::uint32_t> morton_order(const Mesh& mesh, const Vector& low, double side) {
  std::vector<std::uint64_t> keys(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, keys.size(),
                    [&](std::size_t t) { keys[t] = morton_code((mesh.corner(t, 0) - low) / side) << 32 | t; });
  tbb::parallel_sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(keys.size());
  std::transform(keys.begin(), keys.end(), order.begin(),
                 [](std::uint64_t key) { return static_cast<std::uint32_t>(key); });
  return order;
}

}  // namespace vps::bake

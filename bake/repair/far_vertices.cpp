// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/far_vertices.h"

#include <algorithm>

namespace vps::bake {

FarVertices find_far_vertices(const Mesh& mesh, double voxel_size) {
  constexpr std::size_t kLeastVertices = 8;  // of fewer, two at each end are no exceptions
  constexpr double kFar = 1000;
  constexpr double kLargestGrid = 16384;  // [vx]
  const std::size_t n = mesh.vertices.size();
  if (n < kLeastVertices) return {};
  const std::size_t beyond = std::max<std::size_t>(1, n / 100);  // at each end of each axis
  Vector low, high;
  double longest = 0;
  std::vector<double> values(n);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < n; ++v) values[v] = mesh.vertices[v][axis];
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    longest = std::max(longest, *most - *least);
    const auto nth = [&](std::size_t i) {
      std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i), values.end());
      return values[i];
    };
    low[axis] = nth(beyond);
    high[axis] = nth(n - 1 - beyond);
  }
  FarVertices far;
  far.core = (high - low).maxCoeff();
  const bool beyond_any_grid = longest > kLargestGrid * far.core;
  if (!(far.core > 0) || longest < kFar * far.core || !(far.core < voxel_size || beyond_any_grid)) return {};
  // Vertices beside the box belong to the rest.
  const auto distance = [&](std::uint32_t v) {
    const Vector& p = mesh.vertices[v];
    return std::max((low - p).maxCoeff(), (p - high).maxCoeff());
  };
  std::vector<std::uint8_t> is_far(n);
  for (std::uint32_t v = 0; v < n; ++v) {
    const double d = distance(v);
    is_far[v] = d > far.core;
    far.count += is_far[v];
    if (d <= far.distance) continue;
    far.distance = d;
    far.place = mesh.vertices[v];
  }
  const bool apart = std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const Triangle& t) {
    return is_far[t[0]] != 0 && is_far[t[1]] != 0 && is_far[t[2]] != 0;
  });
  return apart && !beyond_any_grid ? FarVertices{} : far;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Closed meshes of analytic shapes, generated in memory.
#pragma once

#include <cmath>
#include <numbers>

#include "sample_meshes/shapes.h"

namespace vps::test {

using samples::make_box;
using samples::make_sphere;
using samples::make_torus;
using samples::make_wheel;

/// Cube whose edges and corners are rounded off.
inline TriangleMesh make_rounded_cube(double half, double radius) {
  constexpr int kSteps = 4;  // to a quarter of a turn
  const auto on_circle = [](int step) {
    const double angle = std::numbers::pi / 2 * step / kSteps;
    return std::array{step == kSteps ? 0 : std::cos(angle), step == 0 ? 0 : std::sin(angle)};
  };
  const double middle = half - radius;  // of the corners' balls
  std::vector<samples::Ring> rings;
  for (int row = -kSteps; row <= kSteps; ++row) {
    for (const int end : {-1, 1}) {
      if (row * end < 0) continue;
      const auto [aside, up] = on_circle(std::abs(row));
      samples::Ring ring;
      for (int quarter = 0; quarter < 4; ++quarter) {
        for (int i = 0; i <= kSteps; ++i) {
          const auto [along, across] = on_circle(i);
          const double x = middle + radius * aside * along;
          const double y = middle + radius * aside * across;
          const double z = end * (middle + radius * up);
          ring.push_back(quarter == 0   ? std::array{x, y, z}
                         : quarter == 1 ? std::array{-y, x, z}
                         : quarter == 2 ? std::array{-x, -y, z}
                                        : std::array{y, -x, z});
        }
      }
      rings.push_back(ring);
    }
  }
  return samples::make_skin(rings, false);
}

/// `outer` with a cavity: `inner` with its triangles reversed.
inline TriangleMesh with_cavity(TriangleMesh outer, const TriangleMesh& inner) {
  const auto base = static_cast<std::uint32_t>(outer.vertices.size());
  outer.vertices.insert(outer.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& [a, b, c] : inner.triangles) outer.triangles.push_back({base + a, base + c, base + b});
  return outer;
}

/// Both meshes in one.
inline TriangleMesh joined(TriangleMesh first, const TriangleMesh& second) {
  const auto base = static_cast<std::uint32_t>(first.vertices.size());
  first.vertices.insert(first.vertices.end(), second.vertices.begin(), second.vertices.end());
  for (const auto& [a, b, c] : second.triangles) first.triangles.push_back({base + a, base + b, base + c});
  return first;
}

}  // namespace vps::test

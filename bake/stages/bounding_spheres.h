// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Minimal enclosing spheres of the tree's nodes, verified in float. Paper: Sec. 2.1.2 [FG04]. Internal to bake.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "bake/stages/cluster_points.h"

namespace vps::bake {

using Point3f = std::array<float, 3>;

struct BoundingSphere {
  Point3f centre{};
  float radius = 0;
};

/// Smallest sphere around the points, its radius rounded up so that every point passes |p - centre| <= radius in float
/// and in double arithmetic.
[[nodiscard]] BoundingSphere bounding_sphere(std::span<const Point3f> points);

/// One sphere per node around all points below it.
/// @param points  in tree order
[[nodiscard]] std::vector<BoundingSphere> bounding_spheres(const PointTree& tree, const std::vector<Point3f>& points);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Minimal enclosing spheres of the tree's nodes, verified in float. Paper: Sec. 2.1.2 [FG04]. Internal to bake.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "bake/stages/cluster_points.h"
#include "formats/quantize.h"

namespace vps::bake {

using Point3f = std::array<float, 3>;

/// Codes of a sphere: its centre is a place of a PositionScale, its radius a number of its steps.
struct BoundingSphere {
  std::array<std::uint16_t, 3> centre{};
  std::uint16_t radius = 0;
};

/// The smallest sphere around the points, with its centre rounded to a code. The radius is then rounded up so that
/// every point passes |p - centre| <= radius in float and in double arithmetic.
/// @param points  in the scale's box
[[nodiscard]] BoundingSphere bounding_sphere(std::span<const Point3f> points, const PositionScale& scale);

/// One sphere per node around all points below it.
/// @param points  in tree order
[[nodiscard]] std::vector<BoundingSphere> bounding_spheres(const PointTree& tree, const std::vector<Point3f>& points,
                                                           const PositionScale& scale);

}  // namespace vps::bake

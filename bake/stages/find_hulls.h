// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Hulls of the flat nodes of the point-sphere tree: where a field is linear, they answer for all points of a
/// face. Internal to bake.
#pragma once

#include "bake/stages/bounding_spheres.h"

namespace vps::bake {

/// Corners of the convex hulls, and the point that represents the node, node after node; nodes that are not flat have
/// none.
struct NodeHulls {
  std::vector<std::uint32_t> offsets;  ///< nodes + 1: where each node's corners begin
  std::vector<std::uint32_t> points;   ///< ascending within a node
};

/// Finds the nodes whose points lie in a plane, and have few corners. Every point below such a node is at most 2 `flat`
/// from the hull of its corners.
/// @param points  in tree order, as queries decode them. [m]
/// @param flat    [m]
[[nodiscard]] NodeHulls find_hulls(const PointTree& tree, const std::vector<Point3f>& points, double flat);

}  // namespace vps::bake

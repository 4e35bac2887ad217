// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Groups points into a tree of clusters, from the leaves up. Paper: Sec. 2.1.2, Eq. (6). Internal to bake.
#pragma once

#include "bake/stages/sample_pointshell.h"

namespace vps::bake {

/// Breadth-first tree. Nodes of level l (root = 1) are [level_offsets[l-1], level_offsets[l]); the children of a node
/// are contiguous, and in order over the whole level. On the leaf level children are points, in the order of `order`.
struct PointTree {
  std::vector<std::uint32_t> order;          ///< original number of each point, in tree order
  std::vector<std::uint32_t> first, count;   ///< children of each node
  std::vector<std::uint32_t> parent_point;   ///< P_1 of each node: its number in tree order
  std::vector<std::uint32_t> level_offsets;  ///< levels + 1
};

/// Sequential clustering by Euclidean distance, with the paper's outlier rule; deterministic.
/// The points of a face form clusters of their own until one is left, so that whole nodes are flat: a face on a face
/// then costs its corners. Other points cluster as in the paper.
/// @param faces      the face of each point, 0: none; empty: there are none
/// @param branching  K. Clusters have K members on average.
[[nodiscard]] PointTree cluster_points(const std::vector<Vector>& positions, const std::vector<std::uint32_t>& faces,
                                       double surface_area, std::uint32_t branching);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Closes cracks and holes, from the mildest means to the strongest. Internal to bake.
#pragma once

#include <optional>

#include "bake/geometry.h"

namespace vps::bake {

/// Merges every vertex with an earlier one within the tolerance. @return number of vertices merged
std::size_t weld_vertices(Mesh& mesh, double tolerance);

/// Sews open edges together: vertices of open edges within the tolerance become one, and an open edge is split where
/// such a vertex lies beside it. @return number of vertices merged and edges split
std::size_t stitch_borders(Mesh& mesh, double tolerance);

struct FilledHoles {
  std::size_t filled = 0;
  std::size_t left = 0;
  double area = 0;                ///< of the patches. [m^2]
  double longest_border = 0;      ///< of those left. [m]
  Vector place = Vector::Zero();  ///< a point of that border
};

/// Triangulates holes (CGAL). A hole is as wide as the least height of the fattest triangle of its patch; those wider
/// than `widest` stay. Winding follows the surface around each hole.
FilledHoles fill_holes(Mesh& mesh, double widest);

/// Number of edges that are used more often in one direction than in the other.
[[nodiscard]] std::size_t count_unbalanced(const Mesh& mesh);

}  // namespace vps::bake

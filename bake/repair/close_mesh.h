// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Repairs that close cracks and holes, from the least invasive to the most. Internal to bake.
#pragma once

#include <optional>
#include <span>

#include "bake/repair/topology.h"

namespace vps::bake {

/// Merges each vertex with the nearest earlier one within the tolerance. @return number of vertices merged
std::size_t weld_vertices(Mesh& mesh, double tolerance);

/// Merges each vertex of an open edge with the nearest earlier one within the tolerance. @return number merged
std::size_t merge_borders(Mesh& mesh, double tolerance);

/// Joins open edges: merges borders, then splits an open edge where a vertex of another lies within the tolerance of
/// it. @return number of vertices merged and edges split
std::size_t stitch_borders(Mesh& mesh, double tolerance);

struct FilledHoles {
  std::size_t filled = 0;
  std::size_t left = 0;           ///< holes that stay open
  double area = 0;                ///< of the patches. [m^2]
  double widest = 0;              ///< width of the holes that stay open. [m]
  double longest_border = 0;      ///< of these holes. [m]
  Vector place = Vector::Zero();  ///< a point of that border
};

/// Triangulates holes (CGAL). A hole's width is the largest of the least heights of its patch's triangles. Holes wider
/// than `widest` stay open. Winding follows the surface around each hole.
FilledHoles fill_holes(Mesh& mesh, double widest);

/// Closes what a union of nearly coincident faces left open, where cuts a rounding apart make slivers.
/// @param size  of the mesh. [m]
/// @return number of edges that stay open
std::size_t close_slivers(Mesh& mesh, double size, double voxel_size);

/// Number of edges that are used more often in one direction than in the other.
[[nodiscard]] std::size_t count_unbalanced(std::span<const EdgeUse> uses);
[[nodiscard]] std::size_t count_unbalanced(const Mesh& mesh);

}  // namespace vps::bake

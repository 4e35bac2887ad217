// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Exact crossings of lines parallel to x with triangles: the basis of every inside test. Internal to bake.
///
/// Predicates are exact (CGAL). A line through an edge or vertex is moved by an infinitesimal (e, e^2) in y and z
/// (simulation of simplicity), so each crossing of a closed surface is counted exactly once and winding numbers are
/// exact.
#pragma once

#include <vector>

#include "bake/grid.h"

namespace vps::bake {

/// How a line parallel to x through (y, z) meets a triangle. 0: not at all. +1: the line enters the solid there, going
/// towards +x. -1: it leaves the solid.
[[nodiscard]] int line_crossing(double y, double z, const Vector& a, const Vector& b, const Vector& c);
[[nodiscard]] inline int line_crossing(double y, double z, const Mesh& mesh, std::size_t triangle) {
  return line_crossing(y, z, mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2));
}

/// x of the crossing with the triangle's plane. Rounded; decide near ties with `crossing_is_beyond`.
[[nodiscard]] double crossing_x(double y, double z, const Mesh& mesh, std::size_t triangle);

/// Whether the line through `point` parallel to x meets the triangle's plane at a greater x than the point's. Exact.
/// @pre line_crossing(point.y, point.z) != 0
[[nodiscard]] bool crossing_is_beyond(const Vector& point, const Mesh& mesh, std::size_t triangle);

/// Whether the point lies in the triangle's plane. Exact. Same precondition.
[[nodiscard]] bool point_on_plane(const Vector& point, const Mesh& mesh, std::size_t triangle);

/// A grid around the mesh with about as many columns as the mesh has triangles: for `InsideTest` without a voxel grid.
[[nodiscard]] Grid column_grid(const Mesh& mesh);

/// Exact inside test for any point of a grid: winding number > 0. A point on the surface may count as either.
class InsideTest {
 public:
  /// @param mesh  must outlive this object
  InsideTest(const Mesh& mesh, const Grid& grid);

  /// Safe from several threads. Points beyond the grid are outside.
  [[nodiscard]] bool inside(const Vector& point) const;

  /// Calls visit(triangle, crossing) for each triangle that the line through the point parallel to x crosses, before
  /// and beyond it.
  template <class Visit>
  void for_each_crossing(const Vector& point, Visit visit) const {
    const std::size_t at = column(point.y(), point.z());
    for (std::size_t i = start_[at]; i < start_[at + 1]; ++i) {
      const int crossing = line_crossing(point.y(), point.z(), mesh_, triangles_[i]);
      if (crossing != 0) visit(triangles_[i], crossing);
    }
  }

 private:
  // Around a triangle, rounded outwards. Most triangles of a column are left out by it, in one cache line.
  struct Box {
    float y[2], z[2];
    float most_x;
  };
  [[nodiscard]] std::size_t column(double y, double z) const;

  const Mesh& mesh_;
  std::vector<Box> boxes_;                // of triangles
  Grid columns_;                          // one or more voxels wide
  std::vector<std::size_t> start_;        // per column along x
  std::vector<std::uint32_t> triangles_;  // those whose box meets the column
};

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
// Alone in its file: these headers of CGAL are slow to compile.
#include "bake/repair/triangulate_hole.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

namespace vps::bake {

std::vector<Triangle> triangulate_hole(const std::vector<Vector>& border) {
  if (border.size() == 3) return {{0, 1, 2}};
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_3> points;
  points.reserve(border.size());
  for (const Vector& v : border) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<CGAL::Triple<int, int, int>> found;
  // The search without Delaunay is cubic in the number of the border's points.
  constexpr std::size_t kCubicLimit = 500;
  CGAL::Polygon_mesh_processing::triangulate_hole_polyline(
      points, std::back_inserter(found),
      CGAL::parameters::use_delaunay_triangulation(true)
          .use_2d_constrained_delaunay_triangulation(false)
          .do_not_use_cubic_algorithm(border.size() > kCubicLimit));
  std::vector<Triangle> triangles;
  triangles.reserve(found.size());
  for (const auto& t : found) {
    triangles.push_back({static_cast<std::uint32_t>(t.first), static_cast<std::uint32_t>(t.second),
                         static_cast<std::uint32_t>(t.third)});
  }
  return triangles;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
// Alone in its file: these headers of CGAL are slow to compile.
#include "bake/repair/triangulate_hole.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <algorithm>
#include <random>

namespace vps::bake {

std::vector<Triangle> triangulate_hole(const std::vector<Vector>& border) {
  if (border.size() == 3) return {{0, 1, 2}};
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  std::vector<Kernel::Point_3> points;
  points.reserve(border.size());
  // CGAL breaks ties by the addresses of its vertices, which differ from thread to thread. Where the border's points
  // are moved by a thousandth of its edges, no two triangulations are equally good.
  std::mt19937 random(1);
  const std::size_t size = border.size();
  for (std::size_t i = 0; i < size; ++i) {
    const Vector at = border[i] - border[0];
    const double most = 1e-3 * std::min((border[i] - border[(i + 1) % size]).norm(),
                                        (border[i] - border[(i + size - 1) % size]).norm());
    const auto shift = [&] { return most * (0x1p-31 * static_cast<double>(random()) - 1); };
    const double x = at.x() + shift();
    const double y = at.y() + shift();
    points.emplace_back(x, y, at.z() + shift());
  }
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

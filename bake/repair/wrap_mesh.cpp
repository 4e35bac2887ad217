// SPDX-License-Identifier: GPL-3.0-or-later
// Alone in its file: these headers of CGAL are slow to compile.
#include "bake/repair/wrap_mesh.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>

#include <array>

namespace vps::bake {

Mesh wrap_mesh(const Mesh& mesh, double alpha, double offset) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Wrap = CGAL::Surface_mesh<Kernel::Point_3>;
  std::vector<Kernel::Point_3> points;
  points.reserve(mesh.vertices.size());
  for (const Vector& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<std::array<std::size_t, 3>> faces;
  faces.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) faces.push_back({t[0], t[1], t[2]});
  Wrap wrap;
  CGAL::alpha_wrap_3(points, faces, alpha, offset, wrap);

  Mesh out;
  out.vertices.reserve(wrap.number_of_vertices());
  std::vector<std::uint32_t> number(wrap.num_vertices());
  for (const auto v : wrap.vertices()) {
    number[v] = static_cast<std::uint32_t>(out.vertices.size());
    const Kernel::Point_3& p = wrap.point(v);
    out.vertices.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : wrap.faces()) {
    Triangle t{};
    std::size_t k = 0;
    for (const auto v : CGAL::vertices_around_face(wrap.halfedge(f), wrap)) t[k++] = number[v];
    out.triangles.push_back(t);
  }
  return out;
}

}  // namespace vps::bake

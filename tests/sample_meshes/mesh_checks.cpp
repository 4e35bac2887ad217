// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's self-intersection test, in its own source as it takes long to compile.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include "tests/sample_meshes/mesh_checks.h"

namespace vps::test {

bool intersects_itself(const TriangleMesh& mesh) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  CGAL::Surface_mesh<Kernel::Point_3> surface;
  std::vector<CGAL::SM_Vertex_index> vertices;
  for (const auto& v : mesh.vertices) vertices.push_back(surface.add_vertex({v[0], v[1], v[2]}));
  for (const auto& t : mesh.triangles) surface.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
  return CGAL::Polygon_mesh_processing::does_self_intersect(surface);
}

}  // namespace vps::test

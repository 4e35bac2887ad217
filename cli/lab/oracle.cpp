// SPDX-License-Identifier: GPL-3.0-or-later
// A source of its own, because CGAL's mesh processing takes long to compile.
#include "cli/lab/oracle.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Cartesian.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Intersections_3/Iso_cuboid_3_Triangle_3.h>
#include <CGAL/Side_of_triangle_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace vps::lab {
namespace {
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Primitive = CGAL::AABB_face_graph_triangle_primitive<Mesh>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
Kernel::Point_3 point3(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}
}  // namespace

struct Oracle::Impl {
  Mesh mesh;
  Tree tree;
  std::unique_ptr<CGAL::Side_of_triangle_mesh<Mesh, Kernel>> side;
};

Oracle::Oracle(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  std::vector<Mesh::Vertex_index> vertices;
  for (const auto& v : mesh.vertices) vertices.push_back(impl_->mesh.add_vertex(point3(v)));
  for (const auto& t : mesh.triangles) {
    if (impl_->mesh.add_face(vertices[t[0]], vertices[t[1]], vertices[t[2]]) == Mesh::null_face()) {
      throw MeasureError(
          "exact depths need a surface whose parts share no edge or corner; separate them, or --repair wrap");
    }
  }
  impl_->tree.insert(faces(impl_->mesh).begin(), faces(impl_->mesh).end(), impl_->mesh);
  impl_->tree.build();
  impl_->side = std::make_unique<CGAL::Side_of_triangle_mesh<Mesh, Kernel>>(impl_->tree);
}
Oracle::~Oracle() = default;

double Oracle::distance(const std::array<double, 3>& p) const {
  return std::sqrt(impl_->tree.squared_distance(point3(p)));
}

int Oracle::side(const std::array<double, 3>& p) const {
  switch ((*impl_->side)(point3(p))) {
    case CGAL::ON_BOUNDED_SIDE:
      return 1;
    case CGAL::ON_BOUNDARY:
      return 0;
    default:
      return -1;
  }
}

std::array<double, 3> Oracle::outward_normal(const std::array<double, 3>& p) const {
  const Kernel::Vector_3 to_surface = impl_->tree.closest_point(point3(p)) - point3(p);
  const double length = std::sqrt(to_surface.squared_length());
  if (!(length > 0)) return {};
  const Kernel::Vector_3 n = to_surface * (side(p) / length);
  return {n.x(), n.y(), n.z()};
}

bool Oracle::points_inward(const std::array<double, 3>& p, const std::array<double, 3>& direction, double reach) const {
  std::vector<Mesh::Face_index> near;
  impl_->tree.all_intersected_primitives(Kernel::Sphere_3(point3(p), reach * reach), std::back_inserter(near));
  const Kernel::Vector_3 along(direction[0], direction[1], direction[2]);
  return std::any_of(near.begin(), near.end(), [&](Mesh::Face_index face) {
    std::array<Kernel::Point_3, 3> corners;
    std::size_t i = 0;
    for (const auto vertex : vertices_around_face(impl_->mesh.halfedge(face), impl_->mesh)) {
      corners[i++] = impl_->mesh.point(vertex);
    }
    return CGAL::normal(corners[0], corners[1], corners[2]) * along < 0;
  });
}

double Oracle::depth_bound(const std::array<std::array<double, 3>, 3>& triangle) const {
  const auto& [a, b, c] = triangle;
  const Kernel::Point_3 centre = CGAL::centroid(point3(a), point3(b), point3(c));
  const Mesh::Face_index face = impl_->tree.closest_point_and_primitive(centre).second;
  std::array<Kernel::Point_3, 3> corners;
  std::size_t i = 0;
  for (const auto vertex : vertices_around_face(impl_->mesh.halfedge(face), impl_->mesh)) {
    corners[i++] = impl_->mesh.point(vertex);
  }
  const Kernel::Triangle_3 closest(corners[0], corners[1], corners[2]);
  double squared = 0;
  for (const auto& corner : triangle) squared = std::max(squared, CGAL::squared_distance(point3(corner), closest));
  return std::sqrt(squared);
}

struct SoupOracle::Impl {
  using Triangles = std::vector<Kernel::Triangle_3>;
  using SoupPrimitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
  Triangles triangles;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, SoupPrimitive>> tree;
};

SoupOracle::SoupOracle(const TriangleMesh& mesh) : impl_(std::make_unique<Impl>()) {
  for (const auto& [a, b, c] : mesh.triangles) {
    const Kernel::Triangle_3 t(point3(mesh.vertices[a]), point3(mesh.vertices[b]), point3(mesh.vertices[c]));
    if (!t.is_degenerate()) impl_->triangles.push_back(t);
  }
  impl_->tree.rebuild(impl_->triangles.cbegin(), impl_->triangles.cend());
  impl_->tree.accelerate_distance_queries();
}
SoupOracle::~SoupOracle() = default;

double SoupOracle::distance(const std::array<double, 3>& p) const {
  return std::sqrt(impl_->tree.squared_distance(point3(p)));
}

std::array<double, 3> SoupOracle::closest(const std::array<double, 3>& p) const {
  const Kernel::Point_3 q = impl_->tree.closest_point(point3(p));
  return {q.x(), q.y(), q.z()};
}

double exact_distance(const TriangleMesh& mesh, const std::array<double, 3>& p, double at_most) {
  using Exact = CGAL::Cartesian<CGAL::Exact_rational>;
  const auto exact = [](const std::array<double, 3>& q) { return Exact::Point_3(q[0], q[1], q[2]); };
  const Exact::Point_3 point = exact(p);
  bool found = false;
  CGAL::Exact_rational least(0);
  for (const auto& t : mesh.triangles) {
    double gap = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [low, high] =
          std::minmax({mesh.vertices[t[0]][axis], mesh.vertices[t[1]][axis], mesh.vertices[t[2]][axis]});
      gap = std::max({gap, low - p[axis], p[axis] - high});
    }
    if (gap > at_most) continue;
    const Exact::Triangle_3 triangle(exact(mesh.vertices[t[0]]), exact(mesh.vertices[t[1]]),
                                     exact(mesh.vertices[t[2]]));
    if (triangle.is_degenerate()) continue;
    const CGAL::Exact_rational squared = CGAL::squared_distance(point, triangle);
    if (!found || squared < least) least = squared;
    found = true;
  }
  return found ? std::sqrt(CGAL::to_double(least)) : std::numeric_limits<double>::infinity();
}

bool touches_exactly(const std::array<std::array<double, 3>, 3>& triangle, const std::array<double, 3>& low,
                     double edge) {
  using Exact = CGAL::Cartesian<CGAL::Exact_rational>;
  const auto exact = [](const std::array<double, 3>& p) { return Exact::Point_3(p[0], p[1], p[2]); };
  const CGAL::Exact_rational e(edge);
  const Exact::Point_3 from = exact(low);
  const Exact::Iso_cuboid_3 cube(from, Exact::Point_3(from.x() + e, from.y() + e, from.z() + e));
  return CGAL::do_intersect(Exact::Triangle_3(exact(triangle[0]), exact(triangle[1]), exact(triangle[2])), cube);
}

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
// CGAL's AABB tree over the surface's triangles.
#include "bake/stages/closest_point.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps::bake {
namespace {
using Kernel = CGAL::Simple_cartesian<double>;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree3 = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
Kernel::Point_3 point3(const Vector& v) {
  return {v.x(), v.y(), v.z()};
}
}  // namespace

struct ClosestPoint::Tree {
  Triangles triangles;
  Tree3 tree;
};

ClosestPoint::ClosestPoint(const Surface& surface) : tree_(std::make_unique<Tree>()) {
  tree_->triangles.reserve(surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    tree_->triangles.emplace_back(point3(surface.corner(t, 0)), point3(surface.corner(t, 1)),
                                  point3(surface.corner(t, 2)));
  }
  tree_->tree.rebuild(tree_->triangles.cbegin(), tree_->triangles.cend());
  // Built here: building on first use from several threads is a race.
  tree_->tree.build();
  tree_->tree.accelerate_distance_queries();
}
ClosestPoint::~ClosestPoint() = default;
ClosestPoint::ClosestPoint(ClosestPoint&&) noexcept = default;
ClosestPoint& ClosestPoint::operator=(ClosestPoint&&) noexcept = default;

double ClosestPoint::distance(const Vector& point) const {
  return std::sqrt(tree_->tree.squared_distance(point3(point)));
}

double ClosestPoint::distance(const Vector& point, std::span<const std::uint32_t> among) const {
  const Kernel::Point_3 from = point3(point);
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t t : among) {
    const Kernel::Point_3 nearest = Kernel().construct_projected_point_3_object()(tree_->triangles[t], from);
    least = std::min(least, CGAL::squared_distance(from, nearest));
  }
  return std::sqrt(least);
}

ClosestPoint::Hit ClosestPoint::along_ray(const Vector& from, const Vector& direction) const {
  const Kernel::Ray_3 ray(point3(from), Kernel::Vector_3(direction.x(), direction.y(), direction.z()));
  const auto found = tree_->tree.first_intersection(ray);
  if (!found) return {};
  const auto distance = [&](const Kernel::Point_3& p) { return (Vector(p.x(), p.y(), p.z()) - from).norm(); };
  Hit hit;
  hit.triangle = static_cast<std::uint32_t>(found->second - tree_->triangles.cbegin());
  if (const auto* const point = boost::get<Kernel::Point_3>(&found->first)) {
    hit.distance = distance(*point);
  } else {
    const auto& segment = boost::get<Kernel::Segment_3>(found->first);
    hit.distance = std::min(distance(segment.source()), distance(segment.target()));
  }
  return hit;
}

}  // namespace vps::bake

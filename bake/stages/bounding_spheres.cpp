// SPDX-License-Identifier: GPL-3.0-or-later
// Minimal enclosing spheres by CGAL. Its double version returns wrong spheres for some lattice points and reports them
// as valid. So every result is checked against every point. A wrong one is tried again with jitter, then in exact
// arithmetic; for many points a sphere around the middle of their box replaces it.
#include "bake/stages/bounding_spheres.h"

#include <CGAL/Cartesian.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Min_sphere_annulus_d_traits_3.h>
#include <CGAL/Min_sphere_d.h>
#include <CGAL/Min_sphere_of_points_d_traits_3.h>
#include <CGAL/Min_sphere_of_spheres_d.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <random>

namespace vps::bake {
namespace {

struct Sphere {
  Vector centre = Vector::Zero();
  double radius = -1;
};

double farthest(const Vector& centre, std::span<const Point3f> points) {
  double squared = 0;
  for (const Point3f& p : points) squared = std::max(squared, (Vector(p[0], p[1], p[2]) - centre).squaredNorm());
  return std::sqrt(squared);
}

// The error of a wrong sphere is far larger than rounding.
bool encloses(const Sphere& sphere, std::span<const Point3f> points) {
  return std::isfinite(sphere.radius) && sphere.centre.allFinite() &&
         farthest(sphere.centre, points) <= sphere.radius * (1 + 1e-6) + std::numeric_limits<float>::min();
}

// Works with points relative to the first one, not scaled: differences keep their digits far from the origin.
Sphere minimal_double(std::span<const Point3f> points, double jitter) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Traits = CGAL::Min_sphere_of_points_d_traits_3<Kernel, double>;
  const Vector shift(points[0][0], points[0][1], points[0][2]);
  std::mt19937 random(12345);  // its sequence is fixed by the standard
  const auto noise = [&] { return jitter * (static_cast<double>(random()) / 4294967296.0 - 0.5); };
  std::vector<Kernel::Point_3> input;
  input.reserve(points.size());
  for (const Point3f& p : points) {
    const Vector q = Vector(p[0], p[1], p[2]) - shift;
    const double x = q.x() + noise();
    const double y = q.y() + noise();
    input.emplace_back(x, y, q.z() + noise());
  }
  CGAL::Min_sphere_of_spheres_d<Traits> minimal(input.begin(), input.end());
  if (minimal.is_empty()) return {};
  auto c = minimal.center_cartesian_begin();
  const double x = *c++;
  const double y = *c++;
  return {Vector(x, y, *c) + shift, minimal.radius()};
}

Sphere minimal_exact(std::span<const Point3f> points) {
  using Number = CGAL::Exact_rational;
  using Kernel = CGAL::Cartesian<Number>;
  using Traits = CGAL::Min_sphere_annulus_d_traits_3<Kernel>;
  std::vector<Kernel::Point_3> input;
  for (const Point3f& p : points) input.emplace_back(Number(p[0]), Number(p[1]), Number(p[2]));
  CGAL::Min_sphere_d<Traits> minimal(input.begin(), input.end());
  const auto c = minimal.center();
  return {Vector(CGAL::to_double(c.x()), CGAL::to_double(c.y()), CGAL::to_double(c.z())),
          std::sqrt(CGAL::to_double(minimal.squared_radius()))};
}

Sphere minimal_sphere(std::span<const Point3f> points) {
  if (points.size() == 1) return {Vector(points[0][0], points[0][1], points[0][2]), 0};
  Sphere sphere = minimal_double(points, 0);
  if (encloses(sphere, points)) return sphere;
  Eigen::AlignedBox3d box;
  for (const Point3f& p : points) box.extend(Vector(p[0], p[1], p[2]));
  sphere = minimal_double(points, 1e-7 * box.diagonal().norm());
  if (encloses(sphere, points)) return sphere;
  constexpr std::size_t kExactLimit = 256;  // exact arithmetic takes 0.6 ms for 16 points
  if (points.size() <= kExactLimit) return minimal_exact(points);
  return {box.center(), farthest(box.center(), points)};
}

}  // namespace

BoundingSphere bounding_sphere(std::span<const Point3f> points, const PositionScale& scale) {
  const Sphere minimal = minimal_sphere(points);
  const auto step = static_cast<float>(scale.step);
  BoundingSphere out;
  Point3f centre;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double origin = scale.origin[axis];
    out.centre[axis] = encode_coordinate(minimal.centre[static_cast<Eigen::Index>(axis)], origin, scale.step);
    centre[axis] = decode_coordinate(out.centre[axis], static_cast<float>(origin), step);
  }
  const auto [x, y, z] = centre;
  float radius = 0;
  for (const Point3f& p : points) {
    const float dx = p[0] - x;
    const float dy = p[1] - y;
    const float dz = p[2] - z;
    radius = std::max(radius, std::sqrt(dx * dx + dy * dy + dz * dz));
  }
  // The float sum may have rounded down, so the distance in double must pass too.
  const double exact = farthest(Vector(x, y, z), points);
  // A code times the step is exact. Half the diagonal of the scale's box has fewer than kLargestCode steps.
  out.radius = static_cast<std::uint16_t>(std::ceil(std::max(static_cast<double>(radius), exact) / scale.step));
  while (static_cast<double>(step) * out.radius < exact || step * static_cast<float>(out.radius) < radius) ++out.radius;
  return out;
}

std::vector<BoundingSphere> bounding_spheres(const PointTree& tree, const std::vector<Point3f>& points,
                                             const PositionScale& scale) {
  const std::size_t nodes = tree.first.size();
  const std::uint32_t leaves = tree.level_offsets[tree.level_offsets.size() - 2];
  // Points below each node are contiguous. Their ranges are joined from the leaves up.
  std::vector<std::uint32_t> first(nodes);
  std::vector<std::uint32_t> last(nodes);
  for (std::size_t n = nodes; n-- > 0;) {
    first[n] = n >= leaves ? tree.first[n] : first[tree.first[n]];
    last[n] = n >= leaves ? tree.first[n] + tree.count[n] : last[tree.first[n] + tree.count[n] - 1];
  }
  std::vector<BoundingSphere> spheres(nodes);
  tbb::parallel_for(std::size_t{0}, nodes, [&](std::size_t n) {
    spheres[n] = bounding_sphere({points.data() + first[n], last[n] - first[n]}, scale);
  });
  return spheres;
}

}  // namespace vps::bake

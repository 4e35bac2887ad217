// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/wall_thickness.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/uniform.h"

namespace vps::bake {
namespace {

// The band field at a point, trilinear between voxel centres.
double trilinear(const Grid& grid, const InsideRuns& runs, const BandField& field, const Vector& p) {
  const Vector cell = (p - grid.origin) / grid.voxel_size - Vector::Constant(0.5);
  std::uint32_t low[3];
  double part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double limit = grid.dims[static_cast<std::size_t>(axis)] - 2.0;
    const double floor = std::clamp(std::floor(cell[axis]), 0.0, limit);
    low[axis] = static_cast<std::uint32_t>(floor);
    part[axis] = cell[axis] - floor;
  }
  double value = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? part[axis] : 1 - part[axis];
    value += weight * field.value(grid, runs, low[0] + d[0], low[1] + d[1], low[2] + d[2]);
  }
  return value;
}

using Kernel = CGAL::Simple_cartesian<double>;
Kernel::Point_3 point3(const Vector& v) {
  return {v.x(), v.y(), v.z()};
}
Kernel::Triangle_3 triangle3(const Surface& surface, std::size_t t) {
  return {point3(surface.corner(t, 0)), point3(surface.corner(t, 1)), point3(surface.corner(t, 2))};
}

// The nearest place where a ray meets the surface.
struct Wall {
  double distance = std::numeric_limits<double>::infinity();  // [m]
  std::size_t triangle = 0;

  // @param met  a point, or a segment of a ray in the triangle's plane
  template <class Met>
  void meet(const Kernel::Ray_3& ray, const Met& met, std::size_t of) {
    const auto from_source = [&](const Kernel::Point_3& p) {
      return std::sqrt(CGAL::squared_distance(ray.source(), p));
    };
    const auto* const point = boost::get<Kernel::Point_3>(&met);
    const auto* const segment = boost::get<Kernel::Segment_3>(&met);
    const double found = point != nullptr ? from_source(*point)
                                          : std::min(from_source(segment->source()), from_source(segment->target()));
    if (found < distance) *this = {found, of};
  }
};

// @param wall_of  the wall that a ray meets first
template <class WallOf>
std::vector<double> thickness_by(const Surface& surface, std::span<const SurfacePoint> points, const WallOf& wall_of) {
  // The ray starts under the triangle it comes from.
  const double skin = 1e-9 * (surface.bounds_max - surface.bounds_min).norm();
  std::vector<double> thickness(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    const Vector& inward = points[n].inward_normal;
    const Kernel::Ray_3 ray(point3(points[n].position + skin * inward),
                            Kernel::Vector_3(inward.x(), inward.y(), inward.z()));
    const Wall wall = wall_of(ray);
    const bool opposite = std::isfinite(wall.distance) && surface.normals[wall.triangle].dot(inward) > std::sqrt(0.5);
    thickness[n] = opposite ? wall.distance : std::numeric_limits<double>::infinity();
  });
  return thickness;
}

// The same as `wall_thickness` where the wall is thinner than `most`, elsewhere perhaps infinite.
std::vector<double> thickness_below(double most, const Surface& surface, const TriangleTree& tree,
                                    std::span<const SurfacePoint> points) {
  return thickness_by(surface, points, [&](const Kernel::Ray_3& ray) {
    const Kernel::Point_3 middle = ray.source() + most / 2 * ray.to_vector();
    thread_local std::vector<std::uint32_t> near;
    near.clear();
    tree.find_within({middle.x(), middle.y(), middle.z()}, most / 2, near);
    Wall wall;
    for (const std::uint32_t t : near) {
      const auto found = CGAL::intersection(ray, triangle3(surface, t));
      if (found) wall.meet(ray, *found, t);
    }
    return wall;
  });
}

}  // namespace

std::vector<SurfacePoint> spread_points(const Surface& surface, std::size_t count) {
  std::vector<double> sums(surface.triangles.size());
  double sum = 0;
  for (std::size_t t = 0; t < sums.size(); ++t) sums[t] = sum += surface.area_normal(t).norm() / 2;
  std::vector<SurfacePoint> points(count);
  for (std::size_t n = 0; n < count; ++n) {
    // Stratified by area: each part of the surface gets points in proportion to its area.
    const double at = sum * (static_cast<double>(n) + uniform(3 * n)) / static_cast<double>(count);
    const auto found = static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), at) - sums.begin());
    const std::size_t t = std::min(found, sums.size() - 1);
    const double u = std::sqrt(uniform(3 * n + 1));
    const double v = uniform(3 * n + 2);
    points[n].position =
        (1 - u) * surface.corner(t, 0) + u * (1 - v) * surface.corner(t, 1) + u * v * surface.corner(t, 2);
    points[n].inward_normal = -surface.normals[t];
  }
  return points;
}

std::vector<double> wall_thickness(const Surface& surface, std::span<const SurfacePoint> points) {
  std::vector<Kernel::Triangle_3> triangles;
  triangles.reserve(surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) triangles.push_back(triangle3(surface, t));
  using Primitive = CGAL::AABB_triangle_primitive<Kernel, std::vector<Kernel::Triangle_3>::const_iterator>;
  CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>> tree(triangles.cbegin(), triangles.cend());
  tree.build();  // on first use from several threads it would be a race
  return thickness_by(surface, points, [&](const Kernel::Ray_3& ray) {
    Wall wall;
    const auto found = tree.first_intersection(ray);
    if (found) wall.meet(ray, found->first, static_cast<std::size_t>(found->second - triangles.cbegin()));
    return wall;
  });
}

ThinWalls find_thin_walls(const Surface& surface, const TriangleTree& tree, const Grid& grid, const InsideRuns& runs,
                          const BandField& field, std::span<const SurfacePoint> points) {
  // In a wall of two voxels V is at most 0.8 voxels at a depth of 1.2. The limit of one voxel leaves room for the error
  // of interpolation.
  const double s = grid.voxel_size;
  std::vector<std::uint8_t> candidate(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    candidate[n] = trilinear(grid, runs, field, points[n].position + 1.2 * s * points[n].inward_normal) < s;
  });
  std::vector<SurfacePoint> chosen;
  for (std::size_t n = 0; n < points.size(); ++n) {
    if (candidate[n] != 0) chosen.push_back(points[n]);
  }
  const double candidates = static_cast<double>(chosen.size());
  // More points would not make the share more accurate.
  constexpr std::size_t kEnough = 20000;
  const std::size_t stride = 1 + chosen.size() / kEnough;
  std::size_t kept = 0;
  for (std::size_t n = 0; n < chosen.size(); n += stride) chosen[kept++] = chosen[n];
  chosen.resize(kept);

  ThinWalls thin;
  if (kept == 0) return thin;
  const std::vector<double> thickness = thickness_below(2 * s, surface, tree, chosen);
  const auto count = std::count_if(thickness.begin(), thickness.end(), [&](double t) { return t < 2 * s; });
  thin.share = static_cast<double>(count) / static_cast<double>(kept) * candidates / static_cast<double>(points.size());
  const auto least = std::min_element(thickness.begin(), thickness.end()) - thickness.begin();
  thin.thinnest = thickness[static_cast<std::size_t>(least)];
  thin.place = chosen[static_cast<std::size_t>(least)].position;
  return thin;
}

}  // namespace vps::bake

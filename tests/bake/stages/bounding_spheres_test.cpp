// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/bounding_spheres.h"

#include <gtest/gtest.h>

#include <limits>

#include "bake/stages/pack_sections.h"
#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

Vector vector(const Point3f& p) {
  return {p[0], p[1], p[2]};
}

// A sphere as readers decode it.
struct Decoded {
  Point3f centre{};
  float radius = 0;
};
Decoded decode(const BoundingSphere& sphere, const PositionScale& scale) {
  Decoded out;
  const auto step = static_cast<float>(scale.step);
  for (std::size_t axis = 0; axis < 3; ++axis)
    out.centre[axis] = decode_coordinate(sphere.centre[axis], static_cast<float>(scale.origin[axis]), step);
  out.radius = step * static_cast<float>(sphere.radius);
  return out;
}

PositionScale scale_of(std::span<const Point3f> points) {
  Vector low = vector(points[0]);
  Vector high = low;
  for (const Point3f& p : points) {
    low = low.cwiseMin(vector(p));
    high = high.cwiseMax(vector(p));
  }
  return position_scale(to_array(low), to_array(high));
}
Decoded sphere_around(std::span<const Point3f> points) {
  const PositionScale scale = scale_of(points);
  return decode(bounding_sphere(points, scale), scale);
}

void expect_contained(const Decoded& sphere, std::span<const Point3f> points) {
  for (const Point3f& p : points) {
    const float dx = p[0] - sphere.centre[0];
    const float dy = p[1] - sphere.centre[1];
    const float dz = p[2] - sphere.centre[2];
    ASSERT_LE(std::sqrt(dx * dx + dy * dy + dz * dz), sphere.radius);
    ASSERT_LE((vector(p) - vector(sphere.centre)).norm(), static_cast<double>(sphere.radius));
  }
}

// Radius of the smallest enclosing sphere by brute force, with centres from all sets of 2, 3 or 4 points.
double smallest_radius(std::span<const Point3f> points) {
  const auto n = static_cast<int>(points.size());
  double best = std::numeric_limits<double>::infinity();
  const auto offer = [&](const Vector& centre) {
    if (!centre.allFinite()) return;  // coincident points
    double r = 0;
    for (const Point3f& p : points) r = std::max(r, (vector(p) - centre).norm());
    best = std::min(best, r);
  };
  const auto at = [&](int i) { return vector(points[static_cast<std::size_t>(i)]); };
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n; ++j) {
      offer((at(i) + at(j)) / 2);
      for (int k = j + 1; k < n; ++k) {
        const Vector a = at(j) - at(i);
        const Vector b = at(k) - at(i);
        const Vector cross = a.cross(b);
        if (cross.squaredNorm() < 1e-24 * a.squaredNorm() * b.squaredNorm()) continue;
        offer(at(i) +
              (b.squaredNorm() * cross.cross(a) - a.squaredNorm() * cross.cross(b)).eval() / (2 * cross.squaredNorm()));
        for (int l = k + 1; l < n; ++l) {
          Eigen::Matrix3d m;
          m << a.transpose(), b.transpose(), (at(l) - at(i)).transpose();
          if (std::abs(m.determinant()) < 1e-12 * a.norm() * b.norm() * (at(l) - at(i)).norm()) continue;
          const Vector rhs(a.squaredNorm() / 2, b.squaredNorm() / 2, (at(l) - at(i)).squaredNorm() / 2);
          offer(at(i) + m.inverse() * rhs);
        }
      }
    }
  }
  return best;
}

TEST(BoundingSpheres, SpheresAreMinimalAndContainEveryPoint) {
  Random random;
  for (int trial = 0; trial < 400; ++trial) {
    const int count = 2 + trial % 7;
    const bool lattice = trial % 2 == 0;
    std::vector<Point3f> points;
    for (int i = 0; i < count; ++i) {
      Point3f p;
      for (float& x : p) {
        const double v = random.between(-4, 4);
        x = static_cast<float>((lattice ? std::round(v) : v) * 1e-5);
      }
      points.push_back(p);
    }
    const Decoded sphere = sphere_around(points);
    expect_contained(sphere, points);
    const double minimal = smallest_radius(points);
    // Half a diagonal for the centre, and a step for the radius.
    ASSERT_LE(sphere.radius, minimal * (1 + 1e-5) + 1.9 * scale_of(points).step) << "trial " << trial;
  }
}

TEST(BoundingSpheres, TheLatticePointsThatBreakTheDoubleSolverAreEnclosed) {
  const std::vector<Point3f> points = {{-3e-5F, -1e-5F, -4e-5F}, {-3e-5F, -3e-5F, 2e-5F}, {1e-5F, 2e-5F, -3e-5F}};
  const Decoded sphere = sphere_around(points);
  expect_contained(sphere, points);
  EXPECT_NEAR(sphere.radius, smallest_radius(points), 1.9 * scale_of(points).step);
}

TEST(BoundingSpheres, FlatClustersOfALatticeAreEnclosed) {
  for (int n = 2; n <= 6; ++n) {
    std::vector<Point3f> points;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        points.push_back({0.001F * static_cast<float>(i), 0.001F * static_cast<float>(j), 0.5F});
      }
    }
    const Decoded sphere = sphere_around(points);
    expect_contained(sphere, points);
    EXPECT_NEAR(sphere.radius, 0.001 * (n - 1) / std::sqrt(2.0), 1e-6);
  }
}

TEST(BoundingSpheres, OnePointAndCoincidentPointsHaveNoRadius) {
  const std::vector<Point3f> one = {{1.5F, 2, 3}};
  EXPECT_EQ(sphere_around(one).radius, 0);
  const std::vector<Point3f> same(5, {1.5F, 2, 3});
  expect_contained(sphere_around(same), same);
  EXPECT_LT(sphere_around(same).radius, 1e-6F);
}

TEST(BoundingSpheres, EveryNodeContainsAllPointsBelowIt) {
  const Scene scene(make_torus(0.1, 0.04, 60, 30), 0.006);
  const Pointshell shell = sample_pointshell(scene.surface, find_corners(scene.surface, scene.grid.voxel_size),
                                             scene.grid, scene.voxels, scene.runs, scene.field, 0.0085, 1);
  const PointTree tree = cluster_points(shell.positions, shell.faces, scene.surface.area, 4);
  AssetInfo info;
  info.bounds_min = to_array(scene.surface.bounds_min);
  info.bounds_max = to_array(scene.surface.bounds_max);
  describe_pointshell(shell, tree, 4, info);
  const std::vector<Point3f> points = tree_points(shell, tree, info);
  const PositionScale scale{info.position_origin, info.position_step};
  const std::vector<BoundingSphere> spheres = bounding_spheres(tree, points, scale);
  const std::size_t leaves = tree.level_offsets[tree.level_offsets.size() - 2];
  std::vector<std::uint32_t> low(spheres.size());
  std::vector<std::uint32_t> high(spheres.size());
  for (std::size_t n = spheres.size(); n-- > 0;) {
    low[n] = n >= leaves ? tree.first[n] : low[tree.first[n]];
    high[n] = n >= leaves ? tree.first[n] + tree.count[n] : high[tree.first[n] + tree.count[n] - 1];
    expect_contained(decode(spheres[n], scale), std::span(points).subspan(low[n], high[n] - low[n]));
  }
  EXPECT_EQ(low[0], 0U);
  EXPECT_EQ(high[0], points.size());
}

}  // namespace
}  // namespace vps::test

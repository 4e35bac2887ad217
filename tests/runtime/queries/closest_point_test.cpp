// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/oracle.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

std::array<double, 3> exact(Vec3 p) {
  return {p.x, p.y, p.z};
}

// Compares with CGAL's distance at points in the band, in the grid and far away.
void expect_closest(const TriangleMesh& mesh, double s, Field field) {
  const auto asset = baked(mesh, all_fields(s));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
  const SoupOracle oracle(mesh);
  const double error = field == Field::scaled ? std::max(map.lambda, map.error) : map.error;
  Random random;
  constexpr int kPoints = 1500;
  int converged = 0;
  int least = 0;
  for (int n = 0; n < kPoints; ++n) {
    const double margin = n % 3 == 0 ? 0 : n % 3 == 1 ? 10 * s : 1000 * s;
    float at[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      at[axis] = static_cast<float>(random.between(map.bounds_min[axis] - margin, map.bounds_max[axis] + margin));
    }
    const Vec3 point{at[0], at[1], at[2]};
    ClosestPoint result;
    ASSERT_EQ(closest_point(map, point, {}, result), Status::ok);
    const double truth = oracle.distance(exact(point));
    ASSERT_LE(result.lower, truth + 1e-9) << n;
    ASSERT_GE(result.upper, truth - 1e-9) << n;
    if (!result.converged) continue;
    ++converged;
    ASSERT_LE(result.residual, 0.01 * s * (1 + 1e-5));
    ASSERT_LE(oracle.distance(exact(result.position)), result.residual + error + 1e-9) << n;
    ASSERT_GE(result.distance + result.residual + error + 1e-6, truth);
    ASSERT_NEAR(result.distance,
                std::hypot(result.position.x - point.x, result.position.y - point.y, result.position.z - point.z),
                1e-6 * result.distance + 1e-9);
    least += result.distance <= truth * 1.01 + error + 0.02 * s;
  }
  EXPECT_GT(converged, 0.95 * kPoints);
  EXPECT_GT(least, 0.9 * converged);
}

TEST(ClosestPoint, OfATorusIsCgals) {
  const TriangleMesh torus = make_torus(0.1, 0.04, 60, 30);
  expect_closest(torus, 0.004, Field::scaled);
  expect_closest(torus, 0.004, Field::real);
}

TEST(ClosestPoint, OfABoxIsCgals) {
  expect_closest(make_box({0.1, 0.06, 0.03}), 0.003, Field::scaled);
}

TEST(ClosestPoint, WhereTheWalkEndsEarlyOnlyTheBoundsAreClaimed) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.005));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  ClosestPoint result;
  ClosestPointOptions options;
  options.max_iterations = 1;
  ASSERT_EQ(closest_point(map, {0, 0, 0}, options, result), Status::ok);
  EXPECT_FALSE(result.converged);
  EXPECT_TRUE(result.inside);
  EXPECT_LE(result.lower, 0.1F);
  EXPECT_GE(result.upper, 0.1F);
  ASSERT_EQ(closest_point(map, {0.3F, 0.02F, 0.01F}, options, result), Status::ok);
  EXPECT_FALSE(result.converged);
  EXPECT_FALSE(result.inside);
  EXPECT_LE(result.lower, 0.2F);
  EXPECT_GE(result.upper, 0.2F);
  ASSERT_EQ(closest_point(map, {0.3F, 0.02F, 0.01F}, {}, result), Status::ok);
  EXPECT_TRUE(result.converged);
  EXPECT_NEAR(result.distance, 0.2, 2e-4);
  EXPECT_NEAR(result.outward_normal.x, 1, 1e-3);
}

TEST(ClosestPoint, BadUseGetsAStatus) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.01));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  VoxelmapView layers;
  ASSERT_EQ(asset->voxelmap(layers, Field::layers), Status::ok);
  ClosestPoint result;
  EXPECT_EQ(closest_point(VoxelmapView{}, {}, {}, result), Status::missing_part);
  EXPECT_EQ(closest_point(layers, {}, {}, result), Status::missing_part);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Vec3 p : {Vec3{nan, 0, 0}, Vec3{0, nan, 0}, Vec3{0, 0, nan}, Vec3{INFINITY, 0, 0}, Vec3{0, 1e30F, 0}}) {
    EXPECT_EQ(closest_point(map, p, {}, result), Status::bad_argument);
  }
  for (const float tolerance : {0.0F, -1.0F, nan, INFINITY}) {
    EXPECT_EQ(closest_point(map, {}, {tolerance, 256}, result), Status::bad_argument);
  }
  EXPECT_EQ(closest_point(map, {}, {0.01F, 0}, result), Status::bad_argument);
}

}  // namespace
}  // namespace vps::test

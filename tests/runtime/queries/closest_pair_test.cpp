// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/queries/closest_pair.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <vector>

#include "cli/lab/oracle.h"
#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

struct PairBody {
  TriangleMesh mesh;
  std::shared_ptr<Asset> asset;
  VoxelmapView map;
  PointshellView shell;
  explicit PairBody(const TriangleMesh& of_mesh, double voxel_size = 0.002)
      : mesh(of_mesh), asset(baked(mesh, all_fields(voxel_size))) {
    EXPECT_EQ(asset->voxelmap(map, Field::scaled), Status::ok);
    EXPECT_EQ(asset->pointshell(shell), Status::ok);
  }
};

TriangleMesh ring_mesh() {
  return make_torus(0.03, 0.012, 40, 24);
}
// Two balls: in many poses the other one is nearly as close.
TriangleMesh two_balls() {
  return joined(make_sphere(0.015, 3, {-0.03, 0, 0}), make_sphere(0.015, 3, {0.03, 0.002, 0}));
}

std::array<double, 3> shell_place(const PointshellView& shell, std::uint32_t i) {
  const Vec3 p = point_position(shell, i);
  return {p.x, p.y, p.z};
}
double gap_between(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// The least distance of two points of the shells, compared one by one.
double least_distance(const PointshellView& first, const PointshellView& second, const Pose& pose) {
  std::vector<std::array<double, 3>> others;
  for (std::uint32_t i = 0; i < second.points; ++i) others.push_back(shell_place(second, i));
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < first.points; ++i) {
    const auto p = moved(pose, shell_place(first, i));
    for (const auto& q : others) least = std::min(least, gap_between(p, q));
  }
  return least;
}

// Touching, and up to 20 m away.
Pose near_or_far(int n, Random& random) {
  return random_pose(random, n % 8 == 7 ? 20 : n % 2 == 0 ? 0.05 : 0.2);
}

TEST(ClosestPair, IsTheOneOfAllPointsForEachInstructionSet) {
  const PairBody first(two_balls());
  const PairBody second(ring_mesh());
  for (std::int64_t target = 1; target > 0; target <<= 1) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    Random random;
    for (int n = 0; n < 12; ++n) {
      const Pose pose = near_or_far(n, random);
      const double least = least_distance(first.shell, second.shell, pose);
      const double rounding = 1e-7 + 1e-5 * least;
      const auto expect_holds = [&](const detail::ClosestPair& pair) {
        ASSERT_NEAR(
            gap_between(moved(pose, shell_place(first.shell, pair.first)), shell_place(second.shell, pair.second)),
            pair.distance, rounding);
        ASSERT_LE(pair.bound, least);
        ASSERT_GE(pair.distance, least - rounding);
      };
      const detail::ClosestPair exact = detail::find_closest_pair(first.shell, second.shell, pose, {});
      expect_holds(exact);
      ASSERT_NEAR(exact.distance, least, rounding);
      ASSERT_NEAR(exact.bound, least, rounding + 1e-5);
      const detail::ClosestPair rough = detail::find_closest_pair(first.shell, second.shell, pose, {0.001F, 0.1F});
      expect_holds(rough);
      const double allowed = std::max(0.001, 0.1 * double{rough.distance});
      ASSERT_LE(rough.distance, least + allowed + rounding);
      ASSERT_GE(rough.bound, rough.distance - allowed - rounding - 1e-5);
      ASSERT_LE(rough.points_tested, exact.points_tested);
      const detail::ClosestPair again = detail::find_closest_pair(first.shell, second.shell, pose, {0, 0, exact.first});
      expect_holds(again);
      ASSERT_NEAR(again.distance, least, rounding);
      ASSERT_LE(again.points_tested, exact.points_tested + second.shell.points / 10);
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

// Without the field's points the search beyond the band knows little more than the field's bounding box.
TEST(Separation, OfBodiesApartIsThatOfTheClosestPointWithTheShellsOfBoth) {
  const PairBody shell(ring_mesh());
  const PairBody field(two_balls());
  const lab::Oracle oracle(field.mesh);
  Scratch scratch;
  SeparationOptions with;
  with.field_shell = &field.shell;
  for (const Field kind : {Field::scaled, Field::real}) {
    VoxelmapView map;
    ASSERT_EQ(field.asset->voxelmap(map, kind), Status::ok);
    const double voxel = map.voxel_size;
    Random random;
    int apart = 0;
    double worst_without = 0;
    for (int n = 0; n < 60; ++n) {
      const Pose pose = random_pose(random, n % 3 == 0 ? 0.3 : 0.08);
      double deepest = -std::numeric_limits<double>::infinity();
      for (std::uint32_t i = 0; i < shell.shell.points; ++i) {
        deepest = std::max(deepest, oracle.penetration(moved(pose, shell_place(shell.shell, i))));
      }
      SeparationResult result;
      ASSERT_EQ(separation(shell.shell, map, pose, with, scratch, result), Status::ok);
      ASSERT_LE(result.lower, deepest) << n;
      ASSERT_GE(result.delta_bound, deepest - 0.3 * voxel) << n;
      ASSERT_GE(result.upper, deepest) << n;
      if (deepest > -2 * voxel) continue;
      ++apart;
      // To a fiftieth, and the error of a walk's end.
      ASSERT_NEAR(result.delta, deepest, 0.1 * voxel - 0.02 * deepest) << n;
      ASSERT_GE(result.lower, 1.02 * deepest - 3.2 * voxel) << n;
      const double sampled = shell.shell.covering_radius + field.shell.covering_radius;
      ASSERT_LE(result.upper, 0.98 * deepest + sampled + 1e-5) << n;
      const auto at = std::array<double, 3>{result.position.x, result.position.y, result.position.z};
      ASSERT_NEAR(gap_between(at, moved(pose, shell_place(shell.shell, result.point))), 0, 1e-7);
      SeparationResult without;
      ASSERT_EQ(separation(shell.shell, map, pose, {}, scratch, without), Status::ok);
      worst_without = std::max(worst_without, without.delta / deepest);
    }
    EXPECT_GT(apart, 30);
    EXPECT_GT(worst_without, 1.05);
  }
}

// A body inside the other one is as far from its surface as one outside.
TEST(Separation, AShellInsideTheFieldsBodyIsNoneApart) {
  const PairBody block(make_box({0.06, 0.06, 0.06}));
  const PairBody ball(make_sphere(0.01, 3));
  const PairBody both(joined(make_sphere(0.01, 3), make_sphere(0.01, 3, {0.2, 0, 0})));
  Scratch scratch;
  SeparationOptions options;
  options.field_shell = &block.shell;
  for (const PairBody* const body : {&ball, &both}) {
    SeparationResult result;
    ASSERT_EQ(separation(body->shell, block.map, pose_at(0.005, 0, 0), options, scratch, result), Status::ok);
    EXPECT_NEAR(result.delta, 0.06, 2.8 * block.map.voxel_size);
    EXPECT_GE(result.upper, 0.0599);
  }
}

TEST(Separation, OtherFieldsHaveNoUseForTheShell) {
  const PairBody body(ring_mesh());
  const BoxField box{{0.01F, 0.02F, 0.03F}};
  Scratch scratch;
  SeparationOptions options;
  options.field_shell = &body.shell;
  SeparationResult with;
  SeparationResult without;
  ASSERT_EQ(separation(body.shell, box, pose_at(0.1, 0, 0), options, scratch, with), Status::ok);
  ASSERT_EQ(separation(body.shell, box, pose_at(0.1, 0, 0), {}, scratch, without), Status::ok);
  EXPECT_EQ(with.delta, without.delta);
  EXPECT_EQ(with.upper, without.upper);
  // A shell without points is none.
  const PointshellView empty;
  options.field_shell = &empty;
  ASSERT_EQ(separation(body.shell, body.map, pose_at(0.1, 0, 0), options, scratch, with), Status::ok);
  ASSERT_EQ(separation(body.shell, body.map, pose_at(0.1, 0, 0), {}, scratch, without), Status::ok);
  EXPECT_EQ(with.delta, without.delta);
}

TEST(TimeOfImpact, TakesFewerStepsWithTheShellsOfBoth) {
  const PairBody shell(ring_mesh());
  const PairBody field(two_balls());
  Scratch scratch;
  Random random;
  std::uint32_t with = 0;
  std::uint32_t without = 0;
  for (int n = 0; n < 20; ++n) {
    Sweep sweep;
    sweep.start = random_pose(random, 0.01);
    sweep.start.translation[2] = 0.3;
    sweep.velocity[2] = -1;
    sweep.angular_velocity[0] = random.between(-5, 5);
    ImpactOptions options;
    ImpactResult far;
    ASSERT_EQ(time_of_impact(shell.shell, field.map, sweep, options, scratch, far), Status::ok);
    options.field_shell = &field.shell;
    ImpactResult near;
    ASSERT_EQ(time_of_impact(shell.shell, field.map, sweep, options, scratch, near), Status::ok);
    ASSERT_EQ(near.impact, far.impact);
    ASSERT_NEAR(near.time, far.time, 2e-3) << n;
    with += near.iterations;
    without += far.iterations;
  }
  EXPECT_LT(with, 0.8 * without);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

struct Body {
  std::shared_ptr<Asset> asset;
  PointshellView shell;
  VoxelmapView map;
  Scratch scratch;
  Body(const TriangleMesh& mesh, double voxel_size) : asset(baked(mesh, all_fields(voxel_size))) {
    EXPECT_EQ(asset->pointshell(shell), Status::ok);
    EXPECT_EQ(asset->voxelmap(map, Field::scaled), Status::ok);
  }
};

// The largest V of all points of a body, tested one by one.
template <class AnyField>
double deepest(const Body& body, const AnyField& field, const Pose& pose) {
  double most = -1e30;
  for (std::uint32_t i = 0; i < body.shell.points; ++i) {
    const Vec3 p = point_position(body.shell, i);
    const auto at = moved(pose, {p.x, p.y, p.z});
    most = std::max<double>(
        most, penetration(field, {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])}));
  }
  return most;
}

Sweep random_sweep(Random& random) {
  Sweep sweep;
  sweep.start = random_pose(random, 0.15);
  sweep.start.translation[2] = random.between(0.1, 0.3);
  sweep.velocity[2] = random.between(-3, 0.3);
  sweep.velocity[0] = random.between(-1, 1);
  for (double& w : sweep.angular_velocity) w = random.between(-20, 20);
  sweep.duration = 0.3;
  return sweep;
}

TEST(TimeOfImpact, OfASpinningBodyIsNeverLateAndWithinTheTolerance) {
  Body body(make_box({0.05, 0.02, 0.01}, {0.01, 0.02, 0.03}), 0.002);
  const HalfSpaceField ground{{0, 0, 1}, 0.01F};
  Random random;
  int hits = 0;
  for (int n = 0; n < 60; ++n) {
    const Sweep sweep = random_sweep(random);
    for (const Contactor contactor : {Contactor::points, Contactor::surface}) {
      ImpactOptions options;
      options.distance = n % 2 == 0 ? 0 : 0.005F;
      options.contactor = contactor;
      options.max_iterations = 2000;
      ImpactResult result;
      ASSERT_EQ(time_of_impact(body.shell, ground, sweep, options, body.scratch, result), Status::ok);
      ASSERT_NE(result.impact, Impact::unfinished) << n;
      // The body is never nearer before the impact.
      constexpr int kParts = 60;
      for (int part = 0; part < kParts; ++part) {
        const Pose pose = pose_at(body.shell, sweep, result.time * part / kParts);
        ASSERT_LT(deepest(body, ground, pose), -options.distance + 1e-6) << n;
      }
      if (result.impact == Impact::none) {
        ASSERT_EQ(result.time, sweep.duration);
        continue;
      }
      ++hits;
      const double early = contactor == Contactor::surface ? body.shell.covering_radius : 0;
      const double there = deepest(body, ground, pose_at(body.shell, sweep, result.time));
      ASSERT_GE(there, -options.distance - options.tolerance - early - 1e-6) << n;
      ASSERT_NEAR(result.separation.delta, there, 1e-6);
    }
  }
  EXPECT_GT(hits, 60);
}

TEST(TimeOfImpact, AFallingSphereMeetsTheGroundWhenItHasFallen) {
  Body ball(make_sphere(0.02, 4), 0.001);
  Sweep fall;
  fall.start = pose_at(0, 0, 1.02);
  fall.velocity[2] = -2;
  ImpactResult result;
  ImpactOptions options;
  options.contactor = Contactor::points;
  ASSERT_EQ(time_of_impact(ball.shell, HalfSpaceField{}, fall, options, ball.scratch, result), Status::ok);
  EXPECT_EQ(result.impact, Impact::hit);
  EXPECT_NEAR(result.time, 0.5, 1e-3);
  EXPECT_LT(result.iterations, 10U);
  fall.duration = 0.49;
  ASSERT_EQ(time_of_impact(ball.shell, HalfSpaceField{}, fall, options, ball.scratch, result), Status::ok);
  EXPECT_EQ(result.impact, Impact::none);
  EXPECT_EQ(result.time, fall.duration);
}

TEST(TimeOfImpact, AFastBodyDoesNotPassAThinWall) {
  Body ball(make_sphere(0.01, 3), 0.001);
  // A tenth of a voxel thick.
  const Body wall(make_box({0.1, 0.1, 0.0001}), 0.002);
  Random random;
  for (const double speed : {1.0, 100.0, 10000.0}) {
    for (int n = 0; n < 20; ++n) {
      Sweep shot;
      shot.start = random_pose(random, 0.06);
      shot.start.translation[2] = 0.5;
      shot.velocity[2] = -speed;
      shot.duration = 1 / speed;
      for (double& w : shot.angular_velocity) w = random.between(-5, 5) * speed;
      for (const Contactor contactor : {Contactor::points, Contactor::surface}) {
        ImpactOptions options;
        options.contactor = contactor;
        ImpactResult result;
        ASSERT_EQ(time_of_impact(ball.shell, wall.map, shot, options, ball.scratch, result), Status::ok);
        ASSERT_EQ(result.impact, Impact::hit) << speed;
        const Pose pose = pose_at(ball.shell, shot, result.time);
        const double gap = pose.translation[2] - 0.01 - 0.0001;
        ASSERT_GE(gap, -1e-4) << "late";
        ASSERT_LT(gap, 0.003);
      }
    }
  }
}

TEST(TimeOfImpact, BodiesThatOverlapMeetAtOnceAndThoseThatRestApartNever) {
  Body ball(make_sphere(0.02, 3), 0.001);
  Sweep sweep;
  ImpactResult result;
  ASSERT_EQ(time_of_impact(ball.shell, ball.map, sweep, {}, ball.scratch, result), Status::ok);
  EXPECT_EQ(result.impact, Impact::hit);
  EXPECT_EQ(result.time, 0);
  sweep.start = pose_at(0, 0, 0.1);
  sweep.duration = 1e6;
  ASSERT_EQ(time_of_impact(ball.shell, ball.map, sweep, {}, ball.scratch, result), Status::ok);
  EXPECT_EQ(result.impact, Impact::none);
  EXPECT_EQ(result.iterations, 1U);
  sweep.angular_velocity[0] = 1000;
  ImpactOptions options;
  options.max_iterations = 5;
  ASSERT_EQ(time_of_impact(ball.shell, ball.map, sweep, options, ball.scratch, result), Status::ok);
  EXPECT_EQ(result.impact, Impact::unfinished);
  EXPECT_GT(result.time, 0);
  EXPECT_LT(result.time, sweep.duration);
}

TEST(TimeOfImpact, TheBodyTurnsAboutItsCentreOfMass) {
  const Body body(make_box({0.05, 0.02, 0.01}, {0.01, 0.02, 0.03}), 0.004);
  Sweep sweep;
  sweep.start = pose_at(1, 2, 3);
  sweep.velocity[0] = 0.5;
  sweep.angular_velocity[2] = M_PI / 2;
  const Pose pose = pose_at(body.shell, sweep, 1);
  EXPECT_EQ(check_pose(pose), Status::ok);
  const auto centre = moved(pose, {0.01, 0.02, 0.03});
  EXPECT_NEAR(centre[0], 1.51, 1e-6);
  EXPECT_NEAR(centre[1], 2.02, 1e-6);
  EXPECT_NEAR(centre[2], 3.03, 1e-6);
  const auto end = moved(pose, {0.06, 0.02, 0.03});
  EXPECT_NEAR(end[0], 1.51, 1e-6);
  EXPECT_NEAR(end[1], 2.07, 1e-6);
}

TEST(TimeOfImpact, BadUseGetsAStatus) {
  Body ball(make_sphere(0.02, 3), 0.002);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ImpactResult result;
  const auto with = [&](const Sweep& sweep, const ImpactOptions& options) {
    return time_of_impact(ball.shell, ball.map, sweep, options, ball.scratch, result);
  };
  Sweep sweep;
  sweep.start.translation[0] = nan;
  EXPECT_EQ(with(sweep, {}), Status::bad_pose);
  sweep = {};
  sweep.velocity[1] = nan;
  EXPECT_EQ(with(sweep, {}), Status::bad_argument);
  sweep = {};
  sweep.angular_velocity[1] = INFINITY;
  EXPECT_EQ(with(sweep, {}), Status::bad_argument);
  for (const double duration : {-1.0, nan, double{INFINITY}}) {
    sweep = {};
    sweep.duration = duration;
    EXPECT_EQ(with(sweep, {}), Status::bad_argument);
  }
  for (const float distance : {-1.0F, NAN, INFINITY}) {
    ImpactOptions options;
    options.distance = distance;
    EXPECT_EQ(with({}, options), Status::bad_argument);
  }
  for (const float tolerance : {-1.0F, 0.0F, NAN}) {
    ImpactOptions options;
    options.tolerance = tolerance;
    EXPECT_EQ(with({}, options), Status::bad_argument);
  }
  ImpactOptions options;
  options.max_iterations = 0;
  EXPECT_EQ(with({}, options), Status::bad_argument);
  EXPECT_EQ(time_of_impact(PointshellView{}, ball.map, {}, {}, ball.scratch, result), Status::missing_part);
  EXPECT_EQ(time_of_impact(ball.shell, VoxelmapView{}, {}, {}, ball.scratch, result), Status::missing_part);
}

}  // namespace
}  // namespace vps::test

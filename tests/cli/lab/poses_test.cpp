// SPDX-License-Identifier: GPL-3.0-or-later
// Searches for poses end after a limited amount of work.
#include "cli/lab/poses.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "cli/lab/fcl.h"
#include "cli/lab/truth.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

// A disc of slivers that meet in its middle: their bounding boxes are nearly as far apart as their triangles.
TriangleMesh fan() {
  return make_wheel(0.5, 0.01, 1000);
}

Pose aside(double distance) {
  return {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.01, 0, distance}};
}

TEST(Poses, ADistanceWithALimitIsFclsOrEndsThere) {
  const TriangleMesh body = fan();
  const lab::LimitedDistance limited(body);
  const auto whole = limited.query(aside(1), std::numeric_limits<std::size_t>::max());
  EXPECT_GT(whole.distance, 0);
  EXPECT_EQ(-whole.distance, lab::fcl_distance(body)->query(aside(1)).depth);
  const auto ended = limited.query(aside(1), 1000);
  EXPECT_GE(ended.tests, 1000U);
  EXPECT_LT(ended.tests, 1100U);  // the boxes on the way back
  EXPECT_LT(ended.tests, whole.tests / 100);
  EXPECT_EQ(limited.query(aside(0), 1000000).distance, 0);
}

// FCL itself takes small triangles for overlapping.
TEST(Poses, DistancesOfSmallBodiesAreThoseOfLargeOnesToScale) {
  constexpr double kSmall = 1e-3;
  const lab::LimitedDistance large(make_sphere(0.5, 4));
  const lab::LimitedDistance small(make_sphere(0.5 * kSmall, 4));
  const auto collide = lab::fcl_collide(make_sphere(0.5 * kSmall, 4));
  constexpr auto kNoLimit = std::numeric_limits<std::size_t>::max();
  for (int i = 0; i < 50; ++i) {
    const double turn = 0.1 * i;
    Pose pose{{std::cos(turn), -std::sin(turn), 0, std::sin(turn), std::cos(turn), 0, 0, 0, 1},
              {0.6 * std::sin(3 * turn), 0.6 * std::cos(3 * turn), 0.9}};
    const double distance = large.query(pose, kNoLimit).distance;
    for (double& t : pose.translation) t *= kSmall;
    EXPECT_GT(distance, 0);
    EXPECT_NEAR(small.query(pose, kNoLimit).distance, kSmall * distance, 1e-9 * kSmall) << i;
    EXPECT_EQ(collide->query(pose).contacts, 0U) << i;
  }
}

// Returns the poses found for one depth with a limit on the work.
std::size_t found(const TriangleMesh& body, std::size_t most_work) {
  lab::PoseOptions options;
  options.ranges = {{1, -0.02, -0.01}};
  options.arrival = 0.005;
  options.most_work = most_work;
  return lab::pair_poses(body, options, {}).size();
}

TEST(Poses, LongDistanceQueriesCountAsWork) {
  EXPECT_EQ(found(fan(), 0), 1U);  // no limit
  EXPECT_EQ(found(fan(), 10000), 0U);
  EXPECT_EQ(found(make_sphere(0.5, 4), 10000), 1U);
}

TEST(Poses, AreNotSoughtWhereNoneIsInContact) {
  const TriangleMesh ball = make_sphere(0.05, 4);
  lab::TruthOptions options = lab::truth_options_for(ball, 30);
  options.most_work = 1;
  int sought = 0;
  options.progress = [&](const char*, double) { ++sought; };
  try {
    (void)lab::find_truth(ball, options, lab::Wrenches::none, {});
    ADD_FAILURE() << "no limit";
  } catch (const lab::MeasureError& error) {
    EXPECT_NE(std::string(error.what()).find("--repair wrap"), std::string::npos) << error.what();
  }
  EXPECT_EQ(sought, 0);
}

}  // namespace
}  // namespace vps::test

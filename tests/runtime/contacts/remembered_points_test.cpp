// SPDX-License-Identifier: GPL-3.0-or-later
// Queries with a ContactCache against those without.
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "runtime/fields/place_field.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

TEST(RememberedPoints, AfterAJumpThereAreNone) {
  // An exact field and no contact distance: a list of reach 0 would serve again at the very pose of the jump.
  Pair s;
  const BoxField box{{0.2F, 0.2F, 0.0605F}};
  ContactCache cache;
  QueryOptions options;
  QueryResult with;
  options.cache = &cache;
  for (const double height : {0.08, 0.07, 0.07}) {
    const Pose pose = pose_at(0.09, 0, height);
    QueryResult without;
    ASSERT_EQ(traverse(s.shell, box, pose, {}, s.scratch, s.contacts, without), Status::ok);
    ASSERT_EQ(traverse(s.shell, box, pose, options, s.scratch, s.contacts, with), Status::ok);
    EXPECT_EQ(with.contacts, without.contacts) << height;
    EXPECT_EQ(with.delta, without.delta) << height;
  }
  EXPECT_GT(with.contacts, 0U);
}

// Small and large steps, to and fro, with rotation.
TEST(RememberedPoints, ChangeNoContacts) {
  Pair s;
  const BoxField box{{0.2F, 0.2F, 0.0605F}};
  Random random;
  for (const bool sampled : {true, false}) {
    ContactCache cache;
    std::uint32_t tested = 0;
    std::uint32_t tested_without = 0;
    int touching = 0;
    Pose pose = pose_at(0.09, 0, 0.08);
    for (int n = 0; n < 3000; ++n) {
      // Tiny steps, small steps, and a jump every 50 steps.
      const double step = n % 50 == 0 ? 0.004 : n % 3 == 0 ? 1e-5 : 1e-7;
      for (double& x : pose.translation) x += random.between(-step, step);
      pose.translation[2] += pose.translation[2] > 0.085 ? -step : step * random.between(-1, 1);
      const double angle = random.between(-step, step) * 10;
      Pose turn;
      turn.rotation[0] = turn.rotation[4] = std::cos(angle);
      turn.rotation[3] = std::sin(angle);
      turn.rotation[1] = -turn.rotation[3];
      pose = relative_pose(turn, pose);
      QueryOptions options;
      options.contact_distance = 0.0005F;
      const auto query = [&](QueryResult& result) {
        return sampled ? traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result)
                       : traverse(s.shell, box, pose, options, s.scratch, s.contacts, result);
      };
      QueryResult without;
      ASSERT_EQ(query(without), Status::ok);
      const std::vector<Contact> expected(s.contacts.begin(), s.contacts.begin() + without.contacts);
      QueryResult with;
      options.cache = &cache;
      ASSERT_EQ(query(with), Status::ok);
      ASSERT_EQ(with.contacts, without.contacts) << n;
      ASSERT_TRUE(same_bytes(expected, std::span(s.contacts).first(with.contacts))) << n;
      for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(with.force[axis], without.force[axis]);
      if (without.contacts > 0) {
        ASSERT_EQ(with.delta, without.delta);
      }
      if (without.points_tested > 0) {
        ASSERT_GE(with.delta_bound + 1e-6, without.delta);
      }
      tested += with.nodes_tested;
      tested_without += without.nodes_tested;
      touching += without.contacts > 0;
    }
    EXPECT_GT(touching, 500);
    EXPECT_LT(tested, tested_without / 2);
  }
}

// V at a point changes by no more than the bound says, also at the edges of a box.
TEST(RememberedPoints, DistancesChangeByNoMoreThanTheMotionAlongAFace) {
  Pair s;
  const HalfSpaceField plane{{0.6F, 0, 0.8F}, 0.03F};
  const BoxField box{{0.3F, 0.5F, 0.1F}};
  Random random(7);
  const auto anywhere = [&] {
    Pose pose = random_pose(random, 0);
    for (int axis = 0; axis < 3; ++axis) pose.translation[axis] = random.between(-0.7, 0.7);
    return pose;
  };
  const auto check = [&](const auto& field) {
    int along = 0;
    for (int n = 0; n < 20'000; ++n) {
      const Pose from = anywhere();
      const Pose to = anywhere();
      const double whole = detail::largest_displacement(s.shell, from, to);
      const double bound = detail::largest_change(s.shell, field, from, to);
      EXPECT_LE(bound, whole * (1 + 1e-6));
      along += bound < whole;
      const std::uint32_t point = static_cast<std::uint32_t>(random.between(0, 1) * (s.shell.points - 1));
      const Vec3 p = point_position(s.shell, point);
      const float before = penetration(field, detail::Transform(from).apply(p));
      const float after = penetration(field, detail::Transform(to).apply(p));
      EXPECT_LE(std::abs(double{after} - double{before}), bound + 1e-6) << n;
    }
    EXPECT_GT(along, 20);
  };
  check(plane);
  check(box);
}

// A body that slides and spins on a plane or a box, far and near, now and then over the edge of the box.
TEST(RememberedPoints, ChangeNoContactsOfASlidingBody) {
  Pair s;
  const HalfSpaceField plane{{0, 0, 1}, 0.0605F};
  const BoxField box{{0.5F, 0.5F, 0.0605F}};
  Random random(3);
  const auto slide = [&](const auto& field) {
    ContactCache cache;
    std::uint64_t tested = 0;
    std::uint64_t tested_without = 0;
    int touching = 0;
    double angle = 0;
    Pose pose = pose_at(0.09, 0, 0.08);
    for (int n = 0; n < 3000; ++n) {
      pose.translation[0] = 0.6 * std::sin(0.02 * n);
      pose.translation[1] = 0.3 * std::cos(0.03 * n);
      pose.translation[2] = 0.08 + (n % 50 < 25 ? 1 : -1) * random.between(0, 2e-6) - (n % 700 < 350 ? 0.003 : 0);
      angle += 0.05;
      pose.rotation[0] = pose.rotation[4] = std::cos(angle);
      pose.rotation[3] = std::sin(angle);
      pose.rotation[1] = -pose.rotation[3];
      QueryOptions options;
      options.contact_distance = 0.0005F;
      QueryResult without;
      ASSERT_EQ(traverse(s.shell, field, pose, options, s.scratch, s.contacts, without), Status::ok);
      const std::vector<Contact> expected(s.contacts.begin(), s.contacts.begin() + without.contacts);
      QueryResult with;
      options.cache = &cache;
      ASSERT_EQ(traverse(s.shell, field, pose, options, s.scratch, s.contacts, with), Status::ok);
      ASSERT_EQ(with.contacts, without.contacts) << n;
      ASSERT_TRUE(same_bytes(expected, std::span(s.contacts).first(with.contacts))) << n;
      tested += with.nodes_tested;
      tested_without += without.nodes_tested;
      touching += without.contacts > 0;
    }
    EXPECT_GT(touching, 500);
    EXPECT_LT(tested, tested_without / 2);
  };
  slide(plane);
  slide(box);
}

// A body that fits closely round another: nearly all points are in the list, and few may touch.
TEST(RememberedPoints, OnlyThoseThatMayHaveComeNearAreTested) {
  const std::shared_ptr<Asset> torus = baked(make_torus(0.1, 0.04, 40, 20), all_fields(0.006));
  VoxelmapView map;
  PointshellView shell;
  ASSERT_EQ(torus->voxelmap(map, Field::scaled), Status::ok);
  ASSERT_EQ(torus->pointshell(shell, 1.015), Status::ok);
  std::vector<Contact> contacts(shell.points);
  Scratch scratch;
  ContactCache cache;
  std::uint64_t listed = 0;
  std::uint64_t tested = 0;
  int changed = 0;
  Random random(5);
  for (int n = 0; n < 4000; ++n) {
    Pose pose;
    for (double& x : pose.translation) x = random.between(-0.5, 0.5) * map.voxel_size;
    QueryOptions options;
    options.contact_distance = static_cast<float>(random.between(0, 0.5)) * map.voxel_size;
    options.cache = &cache;
    QueryResult with;
    // The second query at a place makes a list.
    for (int i = 0; i < 2; ++i) {
      ASSERT_EQ(traverse(shell, map, pose, options, scratch, contacts, with), Status::ok);
    }
    const std::uint32_t before = with.contacts;
    for (double& x : pose.translation) x += random.between(-0.03, 0.03) * map.voxel_size;
    ASSERT_EQ(traverse(shell, map, pose, options, scratch, contacts, with), Status::ok);
    const std::vector<Contact> found(contacts.begin(), contacts.begin() + with.contacts);
    options.cache = nullptr;
    QueryResult without;
    ASSERT_EQ(traverse(shell, map, pose, options, scratch, contacts, without), Status::ok);
    ASSERT_TRUE(same_bytes(found, std::span(contacts).first(without.contacts))) << n;
    changed += without.contacts != before;
    if (with.nodes_tested > 0) continue;
    listed += cache.points.size();
    tested += with.points_tested;
  }
  EXPECT_GT(changed, 3000);
  EXPECT_GT(listed, 5'000'000U);
  EXPECT_LT(tested, 3 * listed / 4);
}

}  // namespace
}  // namespace vps::test

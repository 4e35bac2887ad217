// SPDX-License-Identifier: GPL-3.0-or-later
// Flat nodes answer for their points: beside the regular traverse, which tests every point.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "runtime/fields/penetration.h"
#include "runtime/vps_contacts.h"
#include "tests/runtime/contacts/flat_grounds.h"
#include "tests/runtime/contacts/growth.h"

namespace vps::test {
namespace {

TEST(FlatNodes, TheirCornersHaveTheDepthAndTheExtentOfAllPointsInContact) {
  const Grounds grounds;
  Queries q(*body());
  ASSERT_NE(q.shell.hull_offsets, nullptr);
  Random random;
  std::map<std::string, std::pair<std::size_t, std::size_t>> found;  // hits, contacts
  for (const auto& ground : grounds.all()) {
    for (int n = 0; n < 150; ++n) {
      const Pose pose = n % 10 == 9 ? random_pose(random, 0.05)
                                    : flat_pose(random, ground.top, random.between(-0.0004, 0.002), any_tilt(random));
      const std::span<const Contact> all = q.all(ground.field, pose, kTouching);
      const detail::ContactRows rows = q.hits(ground.field, pose, nullptr);
      found[ground.name].first += rows.count;
      found[ground.name].second += all.size();
      ASSERT_EQ(rows.count == 0, all.empty()) << ground.name << n;
      if (all.empty()) continue;
      std::map<std::uint32_t, float> by_point;
      std::vector<Vec3> everywhere;
      std::vector<Vec3> places;
      float deepest = -1;
      for (const Contact& c : all) {
        by_point[c.point] = c.penetration;
        everywhere.push_back(c.position);
        deepest = std::max(deepest, c.penetration);
      }
      float deepest_hit = -1;
      for (std::uint32_t i = 0; i < rows.count; ++i) {
        ASSERT_TRUE(by_point.contains(rows.feature[i])) << ground.name << n;
        ASSERT_NEAR(rows.penetration[i], by_point[rows.feature[i]], 1e-4 * kBodyVoxel);
        deepest_hit = std::max(deepest_hit, rows.penetration[i]);
        places.push_back(place_of(rows, i));
      }
      ASSERT_GE(deepest_hit, deepest - q.bent(ground.field)) << ground.name << n;
      ASSERT_GE(q.most, deepest - 1e-4 * kBodyVoxel) << ground.name << n;
      for (int k = 0; k < 30; ++k) {
        const double angle = k * 0.21;
        const Vec3 along = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0};
        ASSERT_GE(support(places, along), support(everywhere, along) - q.off) << ground.name << n;
      }
    }
  }
  // A face costs its corners; on a curved ground all points that touch are found.
  for (const char* const flat : {"plane", "box", "coarse"}) {
    EXPECT_LT(10 * found[flat].first, 9 * found[flat].second) << flat;
  }
  EXPECT_LT(found["fine"].first, found["fine"].second);
  for (const auto& [name, counts] : found) EXPECT_GT(counts.first, 500U) << name;
}

// The deepest hits of the segments of a moving body, from all points.
std::map<std::uint32_t, float> deepest_of_segments(const Queries& q, FieldRef field, const Pose& pose,
                                                   const detail::RelativeMotion& motion, std::uint32_t level,
                                                   float distance) {
  const detail::Transform to_field(pose);
  std::map<std::uint32_t, float> deepest;
  for (std::uint32_t node = q.shell.level_offsets[level - 1]; node < q.shell.level_offsets[level]; ++node) {
    const IndexRange below = detail::points_below(q.shell, node);
    for (std::uint32_t point = below.begin; point < below.end; ++point) {
      const Vec3 p = to_field.apply(point_position(q.shell, point));
      const double nearer = growth(field, q.shell, pose, p, detail::way_at(motion, p));
      const float v = penetration(field, p, to_field.rotate(point_inward_normal(q.shell, point)));
      if (!(v >= -(distance + nearer))) continue;
      const auto [at, is_new] = deepest.try_emplace(node, v);
      at->second = std::max(at->second, v);
    }
  }
  return deepest;
}

TEST(FlatNodes, TheDeepestCornerAnswersForItsSegment) {
  const Grounds grounds;
  Queries q(*body());
  Random random;
  PointshellView without = q.shell;
  without.hull_offsets = nullptr;
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> tested;  // points, with flat nodes and without
  for (const auto& ground : grounds.all()) {
    for (int n = 0; n < 100; ++n) {
      const Pose pose = n % 10 == 9 ? random_pose(random, 0.05)
                                    : flat_pose(random, ground.top, random.between(-0.004, 0.002), any_tilt(random));
      const auto part = [&](double most) { return static_cast<float>(random.between(-most, most)); };
      const detail::RelativeMotion motion{{part(0.001), part(0.001), n % 3 == 0 ? 0 : -0.003F + part(0.003)},
                                          {part(0.05), part(0.05), part(0.05)}};
      QueryOptions options;
      options.contact_distance = kTouching;
      options.segment_level = std::min(2U + static_cast<std::uint32_t>(n) % 3, q.shell.levels - 1);
      const auto ahead = [&](const PointshellView& shell) {
        QueryResult result;
        EXPECT_EQ(detail::traverse_ahead(shell, ground.field, pose, options, motion, q.scratch, q.contacts, result),
                  Status::ok);
        return result;
      };
      tested[ground.name].second += ahead(without).points_tested;
      const QueryResult result = ahead(q.shell);
      tested[ground.name].first += result.points_tested;
      std::map<std::uint32_t, float> found;
      for (std::uint32_t i = 0; i < result.contacts; ++i) {
        EXPECT_TRUE(i == 0 || q.contacts[i - 1].node < q.contacts[i].node);
        found[q.contacts[i].node] = q.contacts[i].penetration;
      }
      // Where a hit begins, rounding decides.
      const float rounding = q.bent(ground.field) + 1e-5F;
      const auto least =
          deepest_of_segments(q, ground.field, pose, motion, options.segment_level, kTouching - rounding);
      const auto most = deepest_of_segments(q, ground.field, pose, motion, options.segment_level, kTouching + rounding);
      for (const auto& [node, v] : least) {
        ASSERT_TRUE(found.contains(node)) << ground.name << n;
        ASSERT_GE(found[node], v - q.bent(ground.field)) << ground.name << n;
      }
      for (const auto& [node, v] : found) {
        ASSERT_TRUE(most.contains(node)) << ground.name << n;
        ASSERT_LE(v, most.at(node) + 1e-5F * static_cast<float>(kBodyVoxel) + 1e-7F) << ground.name << n;
      }
    }
  }
  for (const char* const flat : {"plane", "box"}) EXPECT_LT(3 * tested[flat].first, tested[flat].second) << flat;
}

bool same_rows(const detail::ContactRows& a, const detail::ContactRows& b) {
  if (a.count != b.count) return false;
  const auto same = [&](const void* x, const void* y) { return std::memcmp(x, y, 4 * std::size_t{a.count}) == 0; };
  return same(a.feature, b.feature) && same(a.penetration, b.penetration) && same(a.position[0], b.position[0]) &&
         same(a.position[1], b.position[1]) && same(a.position[2], b.position[2]);
}

TEST(FlatNodes, ACacheChangesNothingWhileAFaceSlidesTipsAndLeaves) {
  const Grounds grounds;
  Queries with(*body());
  Queries without(*body());
  Random random;
  std::size_t kept = 0;
  for (const auto& ground : grounds.all()) {
    ContactCache cache;
    for (int run = 0; run < 6; ++run) {
      Pose pose = flat_pose(random, ground.top, 0.0002, any_tilt(random));
      const double speed = std::pow(10, random.between(-7, -4));  // [m a step]
      for (int step = 0; step < 60; ++step) {
        for (double& x : pose.translation) x += random.between(-speed, speed);
        pose.translation[0] += speed;
        const detail::ContactRows a = with.hits(ground.field, pose, &cache);
        const detail::ContactRows b = without.hits(ground.field, pose, nullptr);
        ASSERT_TRUE(same_rows(a, b)) << ground.name << " " << run << " " << step;
        kept += cache.flats.size();
      }
    }
  }
  EXPECT_GT(kept, 1000U);
}

// V of samples beside a face that is oblique in their grid is rounded up and down.
TEST(FlatNodes, AFaceMayBeObliqueInTheMapsGrid) {
  const Pose turn = turned_about_y(0.4);
  const Pose back = relative_pose(turn, Pose());
  const auto ground = Grounds::ground(moved(turn, make_box({0.12, 0.12, 0.02})), 2 * kBodyVoxel);
  VoxelmapView map;
  ASSERT_EQ(ground->voxelmap(map), Status::ok);
  Queries q(*body());
  Random random;
  std::size_t hits = 0;
  std::size_t contacts = 0;
  for (int n = 0; n < 50; ++n) {
    const Pose pose = relative_pose(back, flat_pose(random, 0.02, random.between(-0.0002, 0.001), 0));
    const std::span<const Contact> all = q.all(map, pose, kTouching);
    const detail::ContactRows rows = q.hits(map, pose, nullptr);
    ASSERT_GT(rows.count, 0U) << n;
    hits += rows.count;
    contacts += all.size();
    const auto less = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
    const float deepest = std::max_element(all.begin(), all.end(), less)->penetration;
    ASSERT_GE(*std::max_element(rows.penetration, rows.penetration + rows.count), deepest - q.bent(map)) << n;
  }
  EXPECT_LT(5 * hits, contacts);
}

// The body's upper face lies within the sphere of its node, and beyond the box around the ground.
TEST(FlatNodes, OnBakedGroundTheFaceAboveIsNotOpened) {
  const Grounds grounds;
  Queries q(*body());
  std::vector<FlatPatch> patches;
  ASSERT_EQ(find_flat_patches(q.shell, patches), Status::ok);
  Random random;
  for (int n = 0; n < 20; ++n) {
    const double depth = random.between(0.0001, 0.0004);
    QueryOptions options;
    options.contact_distance = kTouching;
    options.flat_patches = patches;
    const auto tested = [&](FieldRef field, double top) {
      QueryResult result;
      Random same;
      EXPECT_EQ(traverse(q.shell, field, flat_pose(same, top, depth, 0), options, q.scratch, q.contacts, result),
                Status::ok);
      return result.nodes_tested;
    };
    EXPECT_LT(tested(grounds.coarse, 0.02), 1.2 * tested(grounds.plane, 0)) << n;
  }
}

TEST(FlatNodes, EveryInstructionSetFindsTheSameCorners) {
  const Grounds grounds;
  Queries q(*body());
  for (const auto& ground : grounds.all()) {
    Random random;
    for (int n = 0; n < 20; ++n) {
      const Pose pose = flat_pose(random, ground.top, 0.0004, n % 2 == 0 ? 0 : 0.01);
      std::vector<std::set<std::uint32_t>> answers;
      for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
        hwy::SetSupportedTargetsForTest(left & -left);
        const detail::ContactRows rows = q.hits(ground.field, pose, nullptr);
        answers.emplace_back(rows.feature, rows.feature + rows.count);
        hwy::SetSupportedTargetsForTest(0);
      }
      for (const std::set<std::uint32_t>& answer : answers) {
        // Points within a rounding of the contact distance may differ, and nodes within one of acceptance.
        EXPECT_LE(answer.size(), 3 * answers[0].size() + 8) << ground.name << n;
        EXPECT_GE(3 * answer.size() + 8, answers[0].size()) << ground.name << n;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

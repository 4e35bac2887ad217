// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <thread>

#include "tests/runtime/pair.h"
#include "tests/support/count_allocations.h"
#include "tests/support/oracle.h"

namespace vps::test {
namespace {

// V of every point, without a tree.
std::vector<double> every_penetration(const Pair& s, const Pose& pose) {
  std::vector<double> out;
  for (std::uint32_t i = 0; i < s.shell.points; ++i) {
    const Vec3 p = apply(pose, point_position(s.shell, i), false);
    out.push_back(penetration(s.map, p, apply(pose, point_inward_normal(s.shell, i), true)));
  }
  return out;
}

// Eqs. (2) and (3), summed over points with their own V.
struct Sums {
  double force[3] = {0, 0, 0};
  double torque[3] = {0, 0, 0};
  double weights = 0;  // of the points that penetrate, or would after rounding

  Sums(const Pair& s, const Pose& pose, Weight weighed, const std::set<std::uint32_t>& points,
       const std::vector<double>& penetrations) {
    const float* const centre = s.shell.centre_of_mass;
    const Vec3 com = apply(pose, {centre[0], centre[1], centre[2]}, false);
    for (const std::uint32_t i : points) {
      if (penetrations[i] < -1e-6) continue;
      const double weight = weighed == Weight::per_area ? point_area(s.shell, i) : 1;
      weights += weight;
      if (penetrations[i] < 0) continue;
      const Vec3 p = apply(pose, point_position(s.shell, i), false);
      const Vec3 n = apply(pose, point_inward_normal(s.shell, i), true);
      const double w = penetrations[i] * weight;
      const double f[3] = {w * n.x, w * n.y, w * n.z};
      const double r[3] = {p.x - com.x, p.y - com.y, p.z - com.z};
      for (int axis = 0; axis < 3; ++axis) {
        force[axis] += f[axis];
        torque[axis] += r[(axis + 1) % 3] * f[(axis + 2) % 3] - r[(axis + 2) % 3] * f[(axis + 1) % 3];
      }
    }
  }
};

// With sampled fields the contacts are exactly the points with V >= -contact distance; points within `rounding` of that
// limit may differ. With layers, Eq. (4) exceeds the true V by up to half a diagonal where normals do not oppose the
// gradient, so that far points seem to touch. The tree may skip those, but no point that truly touches.
void expect_contacts(const Pair& s, const Pose& pose, const std::set<std::uint32_t>& found,
                     const std::vector<double>& penetrations, double contact_distance, double rounding,
                     const Oracle& oracle) {
  for (std::uint32_t i = 0; i < s.shell.points; ++i) {
    const bool touches = penetrations[i] >= -contact_distance;
    if (touches == found.contains(i)) continue;
    if (s.map.field == Field::layers && touches) {
      const Vec3 p = apply(pose, point_position(s.shell, i), false);
      ASSERT_LT(oracle.penetration({p.x, p.y, p.z}), -contact_distance + 1e-7) << "missed point " << i;
    } else {
      ASSERT_NEAR(penetrations[i], -contact_distance, rounding) << "point " << i;
    }
  }
}

TEST(Traverse, FindsExactlyTheContactsThatEveryPointTestedAloneGives) {
  const Oracle oracle(make_torus(0.1, 0.04, 40, 20));
  for (const Field field : {Field::real, Field::scaled, Field::layers}) {
    Pair s(field);
    Random random;
    int touching = 0;
    for (int n = 0; n < 200; ++n) {
      const Pose pose = random_pose(random, 0.16);
      const std::vector<double> penetrations = every_penetration(s, pose);
      for (const Weight weight : {Weight::per_area, Weight::per_point}) {
        QueryOptions options;
        options.weight = weight;
        options.contact_distance = n % 2 == 0 ? 0 : 0.001F;
        QueryResult result;
        ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
        std::set<std::uint32_t> found;
        for (std::uint32_t i = 0; i < result.contacts; ++i) found.insert(s.contacts[i].point);
        ASSERT_EQ(found.size(), result.contacts);
        // The kernel computes in another order and rounds differently.
        const double rounding = 5e-5 * s.map.voxel_size;
        expect_contacts(s, pose, found, penetrations, options.contact_distance, rounding, oracle);
        if (testing::Test::HasFatalFailure()) return;
        const Sums sums(s, pose, weight, found, penetrations);
        constexpr double kArm = 0.06;  // of the sphere's points about its centre. [m]
        for (int axis = 0; axis < 3; ++axis) {
          ASSERT_NEAR(result.force[axis], sums.force[axis], sums.weights * rounding);
          ASSERT_NEAR(result.torque[axis], sums.torque[axis], sums.weights * rounding * kArm);
        }
        touching += result.contacts > 0;
        if (result.delta >= 0) {
          ASSERT_NEAR(result.delta, *std::ranges::max_element(penetrations), 1e-4 * s.map.voxel_size);
        }
      }
    }
    EXPECT_GT(touching, 100);
  }
}

// Highway selects the machine's best instruction set. The others must give the same result up to rounding, and each
// must reproduce its own result to the bit.
TEST(Traverse, EveryInstructionSetGivesTheSameAnswer) {
  Pair s;
  const std::int64_t supported = hwy::SupportedTargets();
  std::vector<std::int64_t> targets;
  for (std::int64_t target = 1; target > 0; target <<= 1) {
    if ((supported & target) != 0) targets.push_back(target);
  }
  ASSERT_GE(targets.size(), 1U);
  Random random;
  int touching = 0;
  for (int n = 0; n < 100; ++n) {
    const Pose pose = random_pose(random, 0.12);
    QueryOptions options;
    options.contact_distance = 0.0005F;
    options.segment_level = n % 3;
    std::vector<QueryResult> results;
    std::vector<std::vector<Contact>> contacts;
    for (const std::int64_t target : targets) {
      hwy::SetSupportedTargetsForTest(target);
      for (int repeat = 0; repeat < 2; ++repeat) {
        QueryResult result;
        ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
        std::vector<Contact> found(s.contacts.begin(), s.contacts.begin() + result.contacts);
        if (repeat == 1) {
          ASSERT_EQ(std::memcmp(&result, &results.back(), sizeof(result)), 0);
          ASSERT_TRUE(same_bytes(found, contacts.back()));
          continue;
        }
        results.push_back(result);
        contacts.push_back(std::move(found));
      }
    }
    hwy::SetSupportedTargetsForTest(0);
    // The bound that docs/conventions.md states.
    const double rounding = 1e-4 * s.map.voxel_size;
    for (std::size_t t = 1; t < targets.size(); ++t) {
      ASSERT_NEAR(results[t].delta, results[0].delta, rounding) << hwy::TargetName(targets[t]);
      std::map<std::uint32_t, float> first;
      for (const Contact& c : contacts[0]) first[c.point] = c.penetration;
      for (const Contact& c : contacts[t]) {
        if (!first.contains(c.point)) {
          // At the limit of the contact distance, or as deep as another point of its segment.
          ASSERT_TRUE(options.segment_level > 0 || c.penetration < rounding - options.contact_distance);
          continue;
        }
        ASSERT_NEAR(c.penetration, first[c.point], rounding) << hwy::TargetName(targets[t]);
      }
    }
    touching += results[0].contacts > 0;
  }
  EXPECT_GT(touching, 20);
}

TEST(Traverse, ForceOnASphereInAHalfSpaceIsTheDisplacedVolume) {
  // Pressure proportional to depth over the submerged cap: the force is the cap's volume, straight up (Archimedes).
  Pair s;
  const double r = 0.05;
  for (const double depth : {0.005, 0.02, 0.04}) {
    const HalfSpaceField water{{0, 0, 1}, 0};
    const Pose pose = pose_at(-0.01, -0.02, -0.03 + r - depth);
    QueryResult result;
    ASSERT_EQ(traverse(s.shell, water, pose, {}, s.scratch, s.contacts, result), Status::ok);
    const double volume = M_PI * depth * depth * (r - depth / 3);
    EXPECT_NEAR(result.force[2], volume, 0.03 * volume);
    EXPECT_NEAR(result.force[0], 0, 0.01 * volume);
    EXPECT_NEAR(result.torque[0], 0, 0.01 * volume * r);
    EXPECT_NEAR(result.delta, depth, 2e-4);
  }
}

TEST(Traverse, AnalyticFieldsGiveTheDepthOfTheDeepestPoint) {
  Pair s;
  QueryResult result;
  // The sphere of radius 50 mm has its centre at (10, 20, 30) mm in its asset's frame.
  ASSERT_EQ(traverse(s.shell, BoxField{{0.1F, 0.1F, 0.1F}}, pose_at(-0.01, -0.02, 0.1 + 0.05 - 0.003 - 0.03), {},
                     s.scratch, s.contacts, result),
            Status::ok);
  EXPECT_NEAR(result.delta, 0.003, 2e-4);
  EXPECT_GT(result.contacts, 0U);
  ASSERT_EQ(traverse(s.shell, SphereField{0.1F}, pose_at(0.1 + 0.05 - 0.004 - 0.01, -0.02, -0.03), {}, s.scratch,
                     s.contacts, result),
            Status::ok);
  EXPECT_NEAR(result.delta, 0.004, 2e-4);
  EXPECT_GT(result.force[0], 0);
}

TEST(Traverse, SegmentsKeepTheirDeepestPointAndTheWholeForce) {
  Pair s;
  Random random;
  for (int n = 0; n < 60; ++n) {
    const Pose pose = random_pose(random, 0.12);
    QueryResult whole;
    ASSERT_EQ(traverse(s.shell, s.map, pose, {}, s.scratch, s.contacts, whole), Status::ok);
    const std::vector<Contact> all(s.contacts.begin(), s.contacts.begin() + whole.contacts);
    for (std::uint32_t level = 1; level <= s.shell.levels + 1; ++level) {
      QueryOptions options;
      options.segment_level = level;
      QueryResult result;
      ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
      EXPECT_EQ(result.delta, whole.delta);
      for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(result.force[axis], whole.force[axis], 1e-12);
      const std::uint32_t clamped = std::min(level, s.shell.levels);
      std::set<std::uint32_t> nodes;
      float deepest = -1;
      for (std::uint32_t i = 0; i < result.contacts; ++i) {
        const Contact& c = s.contacts[i];
        ASSERT_GE(c.node, s.shell.level_offsets[clamped - 1]);
        ASSERT_LT(c.node, s.shell.level_offsets[clamped]);
        ASSERT_TRUE(nodes.insert(c.node).second) << "two contacts of one segment";
        deepest = std::max(deepest, c.penetration);
      }
      if (whole.contacts > 0) {
        ASSERT_FLOAT_EQ(deepest, static_cast<float>(whole.delta));
        ASSERT_LE(result.contacts, whole.contacts);
        if (level == 1) {
          ASSERT_EQ(result.contacts, 1U);
        }
      }
    }
  }
}

TEST(Traverse, ASmallBufferIsReportedAndNothingElseChanges) {
  Pair s;
  const Pose pose = pose_at(0.09, -0.02, -0.03);
  QueryResult all;
  ASSERT_EQ(traverse(s.shell, s.map, pose, {}, s.scratch, s.contacts, all), Status::ok);
  ASSERT_GT(all.contacts, 3U);
  QueryResult few;
  EXPECT_EQ(traverse(s.shell, s.map, pose, {}, s.scratch, std::span(s.contacts).first(3), few), Status::output_full);
  EXPECT_EQ(few.contacts, all.contacts);
  EXPECT_EQ(few.force[0], all.force[0]);
}

TEST(Traverse, BodiesFarApartAreRejectedAtTheRoot) {
  Pair s;
  QueryResult result;
  ASSERT_EQ(traverse(s.shell, s.map, pose_at(5, 0, 0), {}, s.scratch, s.contacts, result), Status::ok);
  EXPECT_EQ(result.contacts, 0U);
  EXPECT_EQ(result.nodes_tested, 1U);
  EXPECT_EQ(result.points_tested, 0U);
  EXPECT_LT(result.delta, -4.7);
  EXPECT_GT(result.delta, -5);
}

TEST(Traverse, AThousandKilometresFromTheOriginNothingIsLost) {
  Pair s;
  Random random;
  for (int n = 0; n < 50; ++n) {
    Pose map_pose = random_pose(random, 1);
    Pose shell_pose = random_pose(random, 0.12);
    for (int axis = 0; axis < 3; ++axis) shell_pose.translation[axis] += map_pose.translation[axis];
    QueryResult near;
    ASSERT_EQ(traverse(s.shell, s.map, relative_pose(map_pose, shell_pose), {}, s.scratch, s.contacts, near),
              Status::ok);
    for (int axis = 0; axis < 3; ++axis) {
      map_pose.translation[axis] += 1048576;  // a power of two: the sum itself rounds to 2e-10 m
      shell_pose.translation[axis] += 1048576;
    }
    QueryResult far;
    ASSERT_EQ(traverse(s.shell, s.map, relative_pose(map_pose, shell_pose), {}, s.scratch, s.contacts, far),
              Status::ok);
    ASSERT_NEAR(far.delta, near.delta, 1e-6);
  }
}

TEST(Traverse, BadUseGetsAStatus) {
  Pair s;
  QueryResult result;
  Pose bad;
  bad.translation[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(traverse(s.shell, s.map, bad, {}, s.scratch, s.contacts, result), Status::bad_pose);
  bad = {};
  bad.rotation[0] = 2;
  EXPECT_EQ(traverse(s.shell, s.map, bad, {}, s.scratch, s.contacts, result), Status::bad_pose);
  bad = {};
  bad.rotation[8] = -1;  // a mirror
  EXPECT_EQ(traverse(s.shell, s.map, bad, {}, s.scratch, s.contacts, result), Status::bad_pose);
  EXPECT_EQ(check_pose(pose_at(0, 1e12, 0)), Status::ok);
  for (const double distance : {1.1e12, -1e39, 1e300, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(traverse(s.shell, s.map, pose_at(0, 0, distance), {}, s.scratch, s.contacts, result), Status::bad_pose);
  }
  for (const double distance : {1e12, -1e12}) {
    const Pose far = pose_at(distance, 0, 0);
    EXPECT_EQ(traverse(s.shell, s.map, far, {}, s.scratch, s.contacts, result), Status::ok);
    EXPECT_LT(result.delta_bound, -0.9e12);
    EXPECT_EQ(traverse(s.shell, HalfSpaceField{{0, 0, 1}, 1e12F}, far, {}, s.scratch, s.contacts, result), Status::ok);
  }
  QueryOptions options;
  options.contact_distance = -1;
  EXPECT_EQ(traverse(s.shell, s.map, {}, options, s.scratch, s.contacts, result), Status::bad_argument);
  options.contact_distance = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(traverse(s.shell, s.map, {}, options, s.scratch, s.contacts, result), Status::bad_argument);
  EXPECT_EQ(traverse(PointshellView{}, s.map, {}, {}, s.scratch, s.contacts, result), Status::missing_part);
  EXPECT_EQ(traverse(s.shell, VoxelmapView{}, {}, {}, s.scratch, s.contacts, result), Status::missing_part);
}

#ifndef VPS_SANITIZE
TEST(Traverse, AQueryAllocatesNothingOnceItsScratchHasGrown) {
  Pair s;
  s.scratch.reserve(s.shell);
  Random random;
  std::vector<Pose> poses;
  for (int n = 0; n < 50; ++n) poses.push_back(random_pose(random, 0.12));
  QueryResult result;
  std::vector<float> areas(s.shell.nodes);
  EXPECT_EQ(node_areas(s.shell, areas), Status::ok);
  const std::size_t before = allocations;
  for (const Pose& pose : poses) {
    for (const std::uint32_t level : {0U, 3U}) {
      QueryOptions options;
      options.segment_level = level;
      (void)traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result);
      options.max_tests = 200;
      options.node_areas = areas;
      (void)traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result);
    }
    QueryOptions coarse;
    coarse.level = 2;
    coarse.node_areas = areas;
    (void)traverse(s.shell, s.map, pose, coarse, s.scratch, s.contacts, result);
  }
  EXPECT_EQ(allocations, before);
}
#endif

TEST(Traverse, ThreadsShareAnAsset) {
  Pair s;
  Random random;
  std::vector<Pose> poses;
  std::vector<double> expected;
  for (int n = 0; n < 40; ++n) {
    poses.push_back(random_pose(random, 0.12));
    QueryResult result;
    ASSERT_EQ(traverse(s.shell, s.map, poses.back(), {}, s.scratch, s.contacts, result), Status::ok);
    expected.push_back(result.force[0]);
  }
  std::atomic<int> different{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      Scratch scratch;
      std::vector<Contact> contacts(s.shell.points);
      for (int round = 0; round < 5; ++round) {
        for (std::size_t n = 0; n < poses.size(); ++n) {
          QueryResult result;
          const Status status = traverse(s.shell, s.map, poses[n], {}, scratch, contacts, result);
          different += status != Status::ok || result.force[0] != expected[n];
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(different, 0);
}

TEST(RelativePose, UndoesTheFirstBody) {
  Random random;
  const Pose a = random_pose(random, 3);
  const Pose same = relative_pose(a, a);
  for (int i = 0; i < 9; ++i) EXPECT_NEAR(same.rotation[i], i % 4 == 0 ? 1 : 0, 1e-15);
  for (const double x : same.translation) EXPECT_EQ(x, 0);
  EXPECT_EQ(check_pose(a), Status::ok);
}

}  // namespace
}  // namespace vps::test

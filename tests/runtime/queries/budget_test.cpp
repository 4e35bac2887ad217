// SPDX-License-Identifier: GPL-3.0-or-later
// Levels of detail, budgets, areas of nodes, and the choice of shell and map.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <span>

#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

std::vector<float> areas_of(const PointshellView& shell) {
  std::vector<float> areas(shell.nodes);
  EXPECT_EQ(node_areas(shell, areas), Status::ok);
  return areas;
}

// The largest V of all points, tested one by one. Points far outside are left out: the field has no samples there and
// underestimates the distance.
double deepest_of(const Pair& s, const Pose& pose) {
  float deepest = -std::numeric_limits<float>::max();
  for (std::uint32_t i = 0; i < s.shell.points; ++i) {
    const Vec3 p = apply(pose, point_position(s.shell, i), false);
    const Vec3 n = apply(pose, point_inward_normal(s.shell, i), true);
    const float v = penetration(s.map, p, n);
    if (v > -1.5F * s.map.voxel_size) deepest = std::max(deepest, v);
  }
  return deepest;
}

TEST(NodeAreas, OfEachLevelAddUpToTheSurface) {
  const Pair s;
  const std::vector<float> areas = areas_of(s.shell);
  double surface = 0;
  for (std::uint32_t i = 0; i < s.shell.points; ++i) surface += point_area(s.shell, i);
  EXPECT_NEAR(surface, 4 * M_PI * 0.05 * 0.05, 0.02 * surface);
  for (std::uint32_t level = 0; level < s.shell.levels; ++level) {
    const double sum = std::accumulate(areas.begin() + s.shell.level_offsets[level],
                                       areas.begin() + s.shell.level_offsets[level + 1], 0.0);
    EXPECT_NEAR(sum, surface, 1e-6 * surface) << "level " << level + 1;
  }
  std::vector<float> few(s.shell.nodes - 1);
  EXPECT_EQ(node_areas(s.shell, few), Status::bad_argument);
  EXPECT_EQ(node_areas({}, few), Status::missing_part);
}

TEST(SegmentLevelFor, IsTheLevelWhoseNumberOfClustersIsNearest) {
  const Pair s;
  EXPECT_EQ(segment_level_for(s.shell, 0), 0U);
  EXPECT_EQ(segment_level_for({}, 15), 0U);
  EXPECT_EQ(segment_level_for(s.shell, 1), 1U);
  EXPECT_EQ(segment_level_for(s.shell, UINT32_MAX), s.shell.levels);
  for (std::uint32_t level = 1; level <= s.shell.levels; ++level) {
    const std::uint32_t clusters = s.shell.level_offsets[level] - s.shell.level_offsets[level - 1];
    EXPECT_EQ(segment_level_for(s.shell, clusters), level);
    EXPECT_EQ(segment_level_for(s.shell, clusters + clusters / 10), level);
  }
}

TEST(ChooseRoles, FewerPointsPlayTheShellUnlessTheyCannot) {
  const TriangleMesh sphere = make_sphere(0.05, 3);
  bake::BakeOptions fine = all_fields(0.005);
  bake::BakeOptions coarse = all_fields(0.01);
  const auto many = baked(sphere, fine);
  const auto few = baked(sphere, coarse);
  coarse.pointshell = false;
  const auto few_map_only = baked(sphere, coarse);
  coarse.pointshell = true;
  coarse.voxelmap = false;
  const auto few_shell_only = baked(sphere, coarse);
  ShellRole role{};
  EXPECT_EQ(choose_roles(*many, *few, role), Status::ok);
  EXPECT_EQ(role, ShellRole::second);
  EXPECT_EQ(choose_roles(*few, *many, role), Status::ok);
  EXPECT_EQ(role, ShellRole::first);
  EXPECT_EQ(choose_roles(*many, *many, role), Status::ok);
  EXPECT_EQ(role, ShellRole::first);
  EXPECT_EQ(choose_roles(*few_map_only, *many, role), Status::ok);
  EXPECT_EQ(role, ShellRole::second);
  EXPECT_EQ(choose_roles(*many, *few_map_only, role), Status::ok);
  EXPECT_EQ(role, ShellRole::first);
  EXPECT_EQ(choose_roles(*many, *few_shell_only, role), Status::ok);
  EXPECT_EQ(role, ShellRole::second);
  EXPECT_EQ(choose_roles(*few_shell_only, *few_shell_only, role), Status::missing_part);
  EXPECT_EQ(choose_roles(*few_map_only, *few_map_only, role), Status::missing_part);
  EXPECT_EQ(choose_roles(Asset(), *many, role), Status::missing_part);
}

TEST(LevelOfDetail, ABoundHoldsForAllPointsAndContactsStandForNodes) {
  for (const Field field : {Field::scaled, Field::real}) {
    Pair s(field);
    const std::vector<float> areas = areas_of(s.shell);
    Random random;
    int coarse_contacts = 0;
    for (int n = 0; n < 100; ++n) {
      const Pose pose = random_pose(random, 0.15);
      const double deepest = deepest_of(s, pose);
      for (std::uint32_t level = 1; level <= s.shell.levels + 1; ++level) {
        QueryOptions options;
        options.level = level;
        options.node_areas = areas;
        QueryResult result;
        ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
        ASSERT_TRUE(result.complete);
        ASSERT_GE(result.delta_bound + 1e-7, deepest) << "level " << level;
        ASSERT_LT(result.delta_bound, 0.05) << "no point is deeper than the torus is thick";
        const std::uint32_t clamped = std::min(level, s.shell.levels);
        for (std::uint32_t i = 0; i < result.contacts; ++i) {
          const Contact& c = s.contacts[i];
          ASSERT_GE(c.node, s.shell.level_offsets[clamped - 1]);
          ASSERT_LT(c.node, s.shell.level_offsets[clamped]);
          ASSERT_EQ(c.point, s.shell.parent_point[c.node]);
          ASSERT_EQ(c.area, areas[c.node]);
          ASSERT_LE(c.penetration, result.delta + 1e-9);
          const Vec3 p = apply(pose, point_position(s.shell, c.point), false);
          const Vec3 inward = apply(pose, point_inward_normal(s.shell, c.point), true);
          ASSERT_NEAR(c.penetration, penetration(s.map, p, inward), 1e-4 * s.map.voxel_size);
          ++coarse_contacts;
        }
      }
    }
    EXPECT_GT(coarse_contacts, 500);
  }
}

TEST(LevelOfDetail, TheForceOfACoarserShellIsNearlyThatOfAllPoints) {
  // The force on a submerged sphere is its volume, for any number of points (Archimedes).
  Pair s;
  const std::vector<float> areas = areas_of(s.shell);
  QueryOptions options;
  options.level = s.shell.levels;
  options.node_areas = areas;
  const Pose pose = pose_at(-0.01, -0.02, -0.03 - 0.06);
  QueryResult result;
  ASSERT_EQ(traverse(s.shell, HalfSpaceField{}, pose, options, s.scratch, s.contacts, result), Status::ok);
  EXPECT_EQ(result.contacts, s.shell.nodes - s.shell.level_offsets[s.shell.levels - 1]);
  const double volume = 4.0 / 3 * M_PI * 0.05 * 0.05 * 0.05;
  EXPECT_NEAR(result.force[2], volume, 0.05 * volume);
}

TEST(Budget, IsKeptAndBoundsHoldForWhatWasNotVisited) {
  for (const Field field : {Field::scaled, Field::layers}) {
    Pair s(field);
    const std::vector<float> areas = areas_of(s.shell);
    Random random;
    int ran_out = 0;
    int coarse = 0;
    for (int n = 0; n < 100; ++n) {
      const Pose pose = random_pose(random, 0.12);
      const double deepest = field == Field::scaled ? deepest_of(s, pose) : -1;
      QueryOptions options;
      options.contact_distance = n % 2 == 0 ? 0 : 0.001F;
      options.segment_level = n % 3 == 0 ? 2 : 0;
      QueryResult whole;
      ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, whole), Status::ok);
      const std::vector<Contact> expected(s.contacts.begin(), s.contacts.begin() + whole.contacts);
      for (const std::uint32_t budget : {1U, 2U, 10U, 50U, 200U, 1000U, 1000000U}) {
        options.max_tests = budget;
        for (const bool with_areas : {false, true}) {
          options.node_areas = with_areas ? std::span<const float>(areas) : std::span<const float>();
          QueryResult result;
          ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
          ASSERT_LE(result.nodes_tested + result.points_tested, budget);
          ASSERT_GE(result.delta_bound + 1e-7, result.delta);
          ASSERT_GE(result.delta_bound + 1e-7, deepest);
          ran_out += !result.complete;
          if (result.complete) {
            ASSERT_EQ(result.contacts, whole.contacts);
            ASSERT_EQ(result.force[0], whole.force[0]);
            ASSERT_EQ(result.torque[1], whole.torque[1]);
            ASSERT_TRUE(std::ranges::equal(std::as_bytes(std::span(s.contacts).first(result.contacts)),
                                           std::as_bytes(std::span(expected))));
          } else if (!with_areas && options.segment_level == 0) {
            ASSERT_LE(result.contacts, whole.contacts);
          }
          std::set<std::uint32_t> points;
          for (std::uint32_t i = 0; i < std::min<std::uint32_t>(result.contacts, s.shell.points); ++i) {
            ASSERT_TRUE(points.insert(s.contacts[i].point).second) << "a point twice";
            coarse += !result.complete && with_areas;
          }
        }
      }
      ASSERT_TRUE(whole.complete);
    }
    EXPECT_GT(ran_out, 300);
    EXPECT_GT(coarse, 100);
  }
}

TEST(Budget, ThatIsAmpleReachesTheEndOfAWideTree) {
  const Pair s;
  bake::BakeOptions options;
  options.voxel_size = 0.1 / 130;
  options.voxelmap = false;
  options.branching = 64;
  const auto asset = baked(make_box({0.05, 0.05, 0.05}), options);
  PointshellView shell;
  ASSERT_EQ(asset->pointshell(shell), Status::ok);
  // A node and its children's own points exceed one block of work.
  std::uint32_t widest = 0;
  for (std::uint32_t node = 0; node < shell.level_offsets[shell.levels - 1]; ++node) {
    const auto [begin, end] = children_of(shell, node);
    widest = std::max(widest, end - begin);
  }
  ASSERT_GT(widest, 64U);
  Scratch scratch;
  std::vector<Contact> contacts(shell.points);
  Random random;
  for (int n = 0; n < 50; ++n) {
    const Pose pose = random_pose(random, 0.1);
    QueryResult unlimited;
    QueryResult limited;
    ASSERT_EQ(traverse(shell, s.map, pose, {}, scratch, contacts, unlimited), Status::ok);
    QueryOptions ample;
    ample.max_tests = std::numeric_limits<std::uint32_t>::max();
    ASSERT_EQ(traverse(shell, s.map, pose, ample, scratch, contacts, limited), Status::ok);
    ASSERT_TRUE(limited.complete) << n;
    ASSERT_EQ(limited.contacts, unlimited.contacts) << n;
  }
}

TEST(Budget, OfTimeGivesACoarseAnswerAtOnce) {
  Pair s;
  const std::vector<float> areas = areas_of(s.shell);
  QueryOptions options;
  options.node_areas = areas;
  options.max_microseconds = 1e-3F;
  const Pose pose = pose_at(0.09, -0.02, -0.03);
  QueryResult result;
  ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
  EXPECT_FALSE(result.complete);
  EXPECT_LE(result.nodes_tested + result.points_tested, 129U);
  EXPECT_GE(result.delta_bound, deepest_of(s, pose));
  options.max_microseconds = 1e9F;
  ASSERT_EQ(traverse(s.shell, s.map, pose, options, s.scratch, s.contacts, result), Status::ok);
  EXPECT_TRUE(result.complete);
  EXPECT_GT(result.contacts, 0U);
}

TEST(Budget, BadUseGetsAStatus) {
  Pair s;
  const std::vector<float> areas = areas_of(s.shell);
  QueryResult result;
  const auto status_with = [&](auto change) {
    QueryOptions options;
    change(options);
    return traverse(s.shell, s.map, {}, options, s.scratch, s.contacts, result);
  };
  EXPECT_EQ(status_with([](QueryOptions& o) { o.max_microseconds = -1; }), Status::bad_argument);
  EXPECT_EQ(status_with([](QueryOptions& o) { o.max_microseconds = std::nanf(""); }), Status::bad_argument);
  EXPECT_EQ(status_with([](QueryOptions& o) { o.level = 1; }), Status::bad_argument) << "without areas";
  EXPECT_EQ(status_with([&](QueryOptions& o) { o.node_areas = std::span(areas).first(1); }), Status::bad_argument);
  EXPECT_EQ(status_with([&](QueryOptions& o) {
              o.node_areas = areas;
              o.level = o.segment_level = 2;
            }),
            Status::bad_argument);
}

// Here the rows of points are shorter than those of nodes. They are copied so that sanitizers detect a read past the
// end.
TEST(Traverse, AShellMayHaveMoreNodesThanPoints) {
  Pair s;
  bake::BakeOptions options = all_fields(0.004);
  options.branching = 2;
  const auto thin = baked(make_sphere(0.05, 4, {0.01, 0.02, 0.03}), options);
  PointshellView shell;
  ASSERT_EQ(thin->pointshell(shell), Status::ok);
  ASSERT_GT(shell.nodes, shell.points);
  std::vector<std::uint16_t> rows[3];
  for (int axis = 0; axis < 3; ++axis) {
    rows[axis].assign(shell.position[axis], shell.position[axis] + shell.points);
    shell.position[axis] = rows[axis].data();
  }
  s.contacts.resize(shell.points);
  const std::vector<float> areas = areas_of(shell);
  Random random;
  for (int n = 0; n < 300; ++n) {
    Pose pose = random_pose(random, 0.12);
    // Three poses of four penetrate the top of the ring by 0.1 mm, in one leaf or few.
    const double centre[3] = {0.01, 0.02, 0.03};
    const double touch[3] = {0.1, 0, 0.04 + 0.05 - 1e-4};
    for (int i = 0; i < 3 && n % 4 > 0; ++i) {
      pose.translation[i] = touch[i];
      for (int k = 0; k < 3; ++k) pose.translation[i] -= pose.rotation[3 * i + k] * centre[k];
    }
    for (const std::uint32_t level : {0U, 4U, shell.levels}) {
      for (const std::uint32_t segments : {0U, 3U, shell.levels}) {
        if (level > 0 && segments > 0) continue;
        QueryOptions query;
        query.level = level;
        query.segment_level = segments;
        query.node_areas = areas;
        QueryResult result;
        ASSERT_EQ(traverse(shell, s.map, pose, query, s.scratch, s.contacts, result), Status::ok);
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

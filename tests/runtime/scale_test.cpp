// SPDX-License-Identifier: GPL-3.0-or-later
// Assets at another size than their bake's: every answer is that of the unscaled query, with its lengths scaled.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/vps_haptics.h"
#include "runtime/vps_queries.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

constexpr Field kFields[] = {Field::layers, Field::scaled, Field::real};
constexpr double kScales[] = {0.1, 0.37, 2, 10};

Vec3 times(double scale, Vec3 v) {
  return {float(scale * double(v.x)), float(scale * double(v.y)), float(scale * double(v.z))};
}
Pose times(double scale, Pose pose) {
  for (double& x : pose.translation) x *= scale;
  return pose;
}
double apart(Vec3 a, Vec3 b) {
  return std::hypot(double(a.x - b.x), double(a.y - b.y), double(a.z - b.z));
}

TEST(Scale, OtherScalesThanTheLimitsAreRefused) {
  const Pair pair;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double scale : {0.0, -1.0, 0.99e-3, 1001.0, nan, infinite, -infinite}) {
    VoxelmapView map = pair.map;
    PointshellView shell = pair.shell;
    EXPECT_EQ(check_scale(scale), Status::bad_argument);
    EXPECT_EQ(pair.map_asset->voxelmap(map, Field::none, scale), Status::bad_argument);
    EXPECT_EQ(pair.map_asset->pointshell(shell, scale), Status::bad_argument);
    EXPECT_EQ(map.field, Field::none);
    EXPECT_EQ(shell.points, 0U);
  }
  VoxelmapView map;
  EXPECT_EQ(pair.map_asset->voxelmap(map, Field::none, kLeastScale), Status::ok);
  EXPECT_EQ(pair.map_asset->voxelmap(map, Field::none, kMostScale), Status::ok);
}

TEST(Scale, FactsAreThoseOfABakeOfTheScaledMesh) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  TriangleMesh twice = moved(pose_at(0.01, -0.02, 0.03), mesh);
  const auto asset = baked(twice, all_fields(0.006));
  for (auto& p : twice.vertices) {
    for (double& x : p) x *= 2;
  }
  const AssetInfo expected = baked(twice, all_fields(0.012))->info();
  const AssetInfo found = scaled(asset->info(), 2);
  const auto near = [](double a, double b) { EXPECT_NEAR(a, b, 1e-9 * std::abs(b) + 1e-12); };
  near(found.voxel_size, expected.voxel_size);
  near(found.volume, expected.volume);
  near(found.surface_area, expected.surface_area);
  near(found.band_inner, expected.band_inner);
  near(found.band_outer, expected.band_outer);
  near(found.spacing, expected.spacing);
  for (std::size_t i = 0; i < 3; ++i) {
    near(found.bounds_min[i], expected.bounds_min[i]);
    near(found.bounds_max[i], expected.bounds_max[i]);
    near(found.centre_of_mass[i], expected.centre_of_mass[i]);
    near(found.origin[i], expected.origin[i]);
  }
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(found.inertia[i], expected.inertia[i], 1e-9 * expected.inertia[0]);
  // Samples are placed and rounded a little differently.
  EXPECT_NEAR(found.real_error.bound, expected.real_error.bound, 0.2 * expected.real_error.bound);
  EXPECT_NEAR(found.covering_radius, expected.covering_radius, 0.05 * expected.covering_radius);
  EXPECT_EQ(found.points, expected.points);
}

TEST(Scale, PointsRaysAndNearestPlacesScale) {
  Random random;
  for (const Field field : kFields) {
    const Pair pair(field);
    for (const double scale : kScales) {
      VoxelmapView map;
      ASSERT_EQ(pair.map_asset->voxelmap(map, field, scale), Status::ok);
      EXPECT_FLOAT_EQ(map.error, float(scale) * pair.map.error);
      const double near = 1e-4 * double(map.voxel_size);
      for (int i = 0; i < 300; ++i) {
        const Vec3 p{float(random.between(-0.2, 0.2)), float(random.between(-0.2, 0.2)),
                     float(random.between(-0.08, 0.08))};
        const Vec3 normal{0, 0.6F, 0.8F};
        const Vec3 at = times(scale, p);
        // Between voxels of layers, Eq. (4) and the bounds jump.
        const double jump = field == Field::layers ? 2.5 * double(map.voxel_size) : near;
        EXPECT_NEAR(double(penetration(map, at, normal)), scale * double(penetration(pair.map, p, normal)), jump);
        const double bound = double(penetration_bound(pair.map, p));
        if (bound < 1) {
          EXPECT_NEAR(double(penetration_bound(map, at)), scale * bound, 3 * double(map.voxel_size));
        }
        if (field == Field::layers) continue;
        EXPECT_LT(apart(outward_normal(map, at), outward_normal(pair.map, p)), 2e-3) << i;
        ClosestPoint closest[2];
        ASSERT_EQ(closest_point(pair.map, p, {}, closest[0]), Status::ok);
        ASSERT_EQ(closest_point(map, at, {}, closest[1]), Status::ok);
        if (closest[0].converged && closest[1].converged) {
          EXPECT_NEAR(double(closest[1].distance), scale * double(closest[0].distance), 0.05 * double(map.voxel_size));
        }
        RayHit hit[2];
        ASSERT_EQ(cast_ray(pair.map, {p, {0, 0, -1}}, {}, hit[0]), Status::ok);
        ASSERT_EQ(cast_ray(map, {at, {0, 0, -1}}, {}, hit[1]), Status::ok);
        EXPECT_EQ(hit[0].hit, hit[1].hit);
        if (hit[0].hit && hit[1].hit) {
          EXPECT_NEAR(double(hit[1].distance), scale * double(hit[0].distance), 0.02 * double(map.voxel_size));
        }
      }
    }
  }
}

// A shell and a field of scales of their own: the contacts are those of all points tested one by one.
TEST(Scale, ATraverseFindsThePointsThatTouchWhateverTheTwoScales) {
  Random random;
  for (const Field field : kFields) {
    Pair pair(field);
    for (const auto& [of_shell, of_map] : {std::pair(2.0, 1.0), {1.0, 0.5}, {0.1, 1.0}, {3.0, 10.0}, {0.3, 0.1}}) {
      ASSERT_EQ(pair.map_asset->voxelmap(pair.map, field, of_map), Status::ok);
      ASSERT_EQ(pair.shell_asset->pointshell(pair.shell, of_shell), Status::ok);
      int touching = 0;
      ContactCache cache;
      for (int i = 0; i < 40; ++i) {
        const Pose pose = random_pose(random, 0.1 * std::max(of_shell, of_map));
        double deepest = -1e30;
        std::vector<double> v;
        for (std::uint32_t k = 0; k < pair.shell.points; ++k) {
          v.push_back(double(penetration(pair.map, apply(pose, point_position(pair.shell, k), false),
                                         apply(pose, point_inward_normal(pair.shell, k), true))));
          deepest = std::max(deepest, v.back());
        }
        QueryOptions options;
        if (i % 2 == 0) options.cache = &cache;
        options.contact_distance = i % 4 < 2 ? 0 : 0.2F * pair.map.voxel_size;
        QueryResult result;
        ASSERT_EQ(traverse(pair.shell, pair.map, pose, options, pair.scratch, pair.contacts, result), Status::ok);
        std::vector<bool> found(pair.shell.points);
        const double near = 1e-4 * double(pair.map.voxel_size);
        double force[3] = {0, 0, 0};
        for (std::uint32_t k = 0; k < result.contacts; ++k) {
          const Contact& contact = pair.contacts[k];
          found[contact.point] = true;
          if (field != Field::layers) {
            EXPECT_NEAR(double(contact.penetration), v[contact.point], near);
          }
          EXPECT_EQ(contact.area, point_area(pair.shell, contact.point));
          const double weight = std::max(0.0, double(contact.penetration) * double(contact.area));
          force[0] += weight * double(contact.inward_normal.x);
          force[1] += weight * double(contact.inward_normal.y);
          force[2] += weight * double(contact.inward_normal.z);
        }
        for (int axis = 0; axis < 3; ++axis)
          EXPECT_NEAR(result.force[axis], force[axis], 1e-5 * (std::abs(force[axis]) + 1e-9));
        if (field == Field::layers) continue;  // Eq. (4) exceeds the true V: the tree may leave out points
        for (std::uint32_t k = 0; k < pair.shell.points; ++k) {
          if (v[k] > -double(options.contact_distance) + near) {
            EXPECT_TRUE(found[k]) << k;
          }
          if (v[k] < -double(options.contact_distance) - near) {
            EXPECT_FALSE(found[k]) << k;
          }
        }
        if (deepest > 0) {
          EXPECT_NEAR(result.delta, deepest, near);
        }
        // Beyond the band V may exceed the true one, which the bounds hold for.
        const bool in_band =
            deepest > -0.5 * double(pair.map.band_outer) && deepest < 0.5 * double(pair.map.band_inner);
        if (in_band) {
          EXPECT_GE(result.delta_bound, deepest - near);
        }
        SeparationResult separated;
        ASSERT_EQ(separation(pair.shell, pair.map, pose, {}, pair.scratch, separated), Status::ok);
        if (in_band) {
          EXPECT_NEAR(separated.delta, deepest, near);
          EXPECT_GE(separated.delta_bound, deepest - near);
        }
        options.segment_level = 3;
        options.cache = nullptr;
        ASSERT_EQ(traverse(pair.shell, pair.map, pose, options, pair.scratch, pair.contacts, result), Status::ok);
        if (deepest > 0) {
          EXPECT_NEAR(result.delta, deepest, near);
        }
        touching += deepest > 0;
      }
      EXPECT_GT(touching, field == Field::layers ? -1 : 3) << of_shell << ' ' << of_map;
    }
  }
}

TEST(Scale, AnImpactOfScaledBodiesIsAtTheSameTime) {
  Pair pair;
  Sweep sweep;
  sweep.start = pose_at(0.1, 0.01, 0.2);
  sweep.velocity[2] = -0.2;
  sweep.angular_velocity[1] = 1;
  ImpactOptions options;
  ImpactResult expected;
  ASSERT_EQ(time_of_impact(pair.shell, pair.map, sweep, options, pair.scratch, expected), Status::ok);
  ASSERT_EQ(expected.impact, Impact::hit);
  for (const double scale : kScales) {
    VoxelmapView map;
    PointshellView shell;
    ASSERT_EQ(pair.map_asset->voxelmap(map, Field::scaled, scale), Status::ok);
    ASSERT_EQ(pair.shell_asset->pointshell(shell, scale), Status::ok);
    Sweep larger = sweep;
    larger.start = times(scale, sweep.start);
    larger.velocity[2] *= scale;
    ImpactOptions scaled_options;
    scaled_options.tolerance = float(scale) * options.tolerance;
    ImpactResult found;
    ASSERT_EQ(time_of_impact(shell, map, larger, scaled_options, pair.scratch, found), Status::ok);
    EXPECT_EQ(found.impact, Impact::hit);
    EXPECT_NEAR(found.time, expected.time, 1e-3);
  }
}

TEST(Scale, ACacheThatMeetsAnotherScaleStartsAnew) {
  Pair pair;
  ContactCache cache;
  QueryOptions options;
  options.cache = &cache;
  const Pose pose = pose_at(0.1, 0, 0.045);
  for (const bool of_map : {false, true}) {
    for (const double scale : {1.0, 1.0, 2.0, 1.0, 1.0, 1.5}) {
      ASSERT_EQ(pair.map_asset->voxelmap(pair.map, Field::scaled, of_map ? scale : 1), Status::ok);
      ASSERT_EQ(pair.shell_asset->pointshell(pair.shell, of_map ? 1 : scale), Status::ok);
      QueryResult cached, fresh;
      ASSERT_EQ(traverse(pair.shell, pair.map, pose, options, pair.scratch, pair.contacts, cached), Status::ok);
      ASSERT_EQ(traverse(pair.shell, pair.map, pose, {}, pair.scratch, pair.contacts, fresh), Status::ok);
      EXPECT_EQ(cached.contacts, fresh.contacts) << scale;
      EXPECT_GT(fresh.contacts, 0U);
    }
  }
}

TEST(Scale, AScaledToolTurnsAsTheUnscaledOne) {
  Pair pair;
  const auto press = [&](double scale) {
    VoxelmapView map;
    PointshellView tool;
    EXPECT_EQ(pair.map_asset->voxelmap(map, Field::scaled, scale), Status::ok);
    EXPECT_EQ(pair.shell_asset->pointshell(tool, scale), Status::ok);
    CouplingOptions options;
    options.angular_stiffness *= scale * scale;
    options.max_force = 1e9;
    VirtualTool virtual_tool(tool, map, times(scale, pose_at(0.09, 0, 0.1)), options);
    HapticCycle cycle;
    for (int i = 0; i < 300; ++i) {
      EXPECT_EQ(virtual_tool.step(times(scale, pose_at(0.09, 0, 0.1 - 2e-4 * i)), cycle), Status::ok);
    }
    return cycle;
  };
  const HapticCycle plain = press(1);
  EXPECT_GT(std::abs(plain.felt.force[2]), 1);
  for (const double scale : {0.5, 2.0, 4.0}) {
    const HapticCycle found = press(scale);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(found.tool.translation[axis], scale * plain.tool.translation[axis], scale * 1e-3) << scale;
    }
    EXPECT_NEAR(found.felt.force[2], scale * plain.felt.force[2], 0.05 * scale * std::abs(plain.felt.force[2]));
  }
}

}  // namespace
}  // namespace vps::test

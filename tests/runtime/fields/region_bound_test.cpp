// SPDX-License-Identifier: GPL-3.0-or-later
// One plane bounds V wherever a shell is, and queries with it find what they find without.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "cli/lab/oracle.h"
#include "runtime/contacts/find_hits.h"
#include "runtime/fields/region_bound.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

struct Ground {
  const char* name;
  TriangleMesh mesh;
  bool is_level;  // nearly everywhere
  double slope = 0;
};

// Level, with a step, with walls, sloping and round.
std::vector<Ground> grounds() {
  const TriangleMesh slab = make_box({0.3, 0.3, 0.03});
  const TriangleMesh step =
      joined(make_box({0.15, 0.3, 0.03}, {-0.15, 0, 0}), make_box({0.15, 0.3, 0.05}, {0.16, 0, 0}));
  const TriangleMesh walls =
      joined(make_box({0.02, 0.3, 0.1}, {-0.3, 0, 0.1}), make_box({0.3, 0.02, 0.1}, {0, 0.3, 0.1}));
  return {{"slab", slab, true},
          {"step", step, false},
          {"room", joined(slab, walls), true},
          {"slope", moved(turned_about_y(0.4), slab), false, 0.4},
          {"torus", make_torus(0.25, 0.06, 60, 30), false}};
}

constexpr double kVoxel = 0.004;

std::shared_ptr<Asset> baked_ground(const Ground& ground) {
  bake::BakeOptions options;
  options.voxel_size = kVoxel;
  return baked(ground.mesh, options);
}
VoxelmapView map_of(const Asset& asset) {
  VoxelmapView map;
  EXPECT_EQ(asset.voxelmap(map, Field::scaled), Status::ok);
  EXPECT_NE(map.planes, nullptr);
  return map;
}

TEST(RegionBound, IsAboveTheTrueVAndTheFieldInItsRegion) {
  for (const Ground& ground : grounds()) {
    const auto asset = baked_ground(ground);
    const VoxelmapView map = map_of(*asset);
    const detail::Frame frame = detail::voxel_frame(map);
    const lab::Oracle oracle(ground.mesh);
    const double end = double{detail::end_of_band(map.band_outer, map.voxel_size)};
    Random random(3);
    int tight = 0;
    int touching = 0;
    for (int n = 0; n < 2000; ++n) {
      float low[3];
      float high[3];
      const double half = random.between(4, 40);
      for (int axis = 0; axis < 3; ++axis) {
        const double middle = random.between(-30, map.dims[axis] + 30);
        low[axis] = static_cast<float>(middle - half);
        high[axis] = static_cast<float>(middle + half);
      }
      const RegionBound region = detail::bound_region(map, low, high);
      if (!region.is_tight) continue;
      ++tight;
      for (int k = 0; k < 100; ++k) {
        double height{region.height};
        double room = half;
        std::array<double, 3> place;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const double at = random.between(double{low[axis]}, double{high[axis]});
          room = std::min({room, at - double{low[axis]}, double{high[axis]} - at});
          height += double{region.slope[axis]} * (at - 0.5 * (double{low[axis]} + double{high[axis]}));
          place[axis] = frame.origin[axis] + frame.unit * at;
        }
        const double truth = oracle.penetration({place[0], place[1], place[2]}) / kVoxel;
        ASSERT_GE(std::max(height, -room), std::min(truth, -double{map.error} / kVoxel)) << ground.name << ' ' << n;
        const Vec3 p{static_cast<float>(place[0]), static_cast<float>(place[1]), static_cast<float>(place[2])};
        const detail::OwnPenetration own = detail::own_penetration(map, p, {});
        if (!own.sampled || double{own.v} < -end) continue;
        ASSERT_GE(height, std::min(double{own.v}, 0.0) / kVoxel) << ground.name << ' ' << n;
        ++touching;
      }
    }
    if (!ground.is_level) continue;
    EXPECT_GT(tight, 100) << ground.name;
    EXPECT_GT(touching, 1000) << ground.name;
  }
}

// Beyond the band a look-up errs, so that a motion may have contacts that cannot arrive. The bound drops some.
void drop_those_that_cannot_arrive(const lab::Oracle& oracle, double farthest, const std::vector<Contact>& kept,
                                   std::vector<Contact>& all) {
  std::erase_if(all, [&](const Contact& contact) {
    const bool is_kept = std::ranges::any_of(kept, [&](const Contact& k) { return k.point == contact.point; });
    const auto [x, y, z] = contact.position;
    return !is_kept && oracle.penetration({x, y, z}) < -0.999 * farthest;
  });
}

// Bodies fall on, slide over, leave and return to grounds whose voxels are coarse against them.
TEST(RegionBound, QueriesWithAMemoryFindTheSameContacts) {
  bake::BakeOptions fine;
  fine.voxel_size = 0.001;
  const auto ball = baked(make_sphere(0.03, 4), fine);
  const auto box = baked(make_box({0.02, 0.015, 0.01}), fine);
  for (const Ground& ground : grounds()) {
    const auto asset = baked_ground(ground);
    const VoxelmapView map = map_of(*asset);
    const lab::Oracle oracle(ground.mesh);
    const double end = double{detail::end_of_band(map.band_outer, map.voxel_size)};
    for (const auto& body : {ball, box}) {
      PointshellView shell;
      ASSERT_EQ(body->pointshell(shell), Status::ok);
      Scratch scratch;
      std::vector<Contact> contacts(shell.points);
      for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
        hwy::SetSupportedTargetsForTest(left & -left);
        ContactCache cache;
        Random random(7);
        int touching = 0;
        int tight = 0;
        Pose pose = random_pose(random, 0);
        for (int n = 0; n < 600; ++n) {
          // Somewhere near the surface, then steps of all sizes; a body that strays far starts again.
          if (n % 60 == 0 || std::abs(pose.translation[2]) > 0.2) {
            pose = random_pose(random, 0);
            pose.translation[0] = random.between(-0.32, 0.32);
            pose.translation[1] = random.between(-0.32, 0.32);
            pose.translation[2] = 0.03 + random.between(0, 0.05) - std::tan(ground.slope) * pose.translation[0];
          }
          const double step = n % 7 == 0 ? 0.01 : n % 3 == 0 ? 1e-3 : 1e-5;
          for (double& x : pose.translation) x += random.between(-step, step);
          QueryOptions options;
          options.contact_distance = static_cast<float>(random.between(0, n % 2 == 0 ? 0.3 : 4) * kVoxel);
          const detail::RelativeMotion motion{{0, 0, static_cast<float>(random.between(0, 5) * kVoxel)}, {}};
          const bool is_ahead = n % 4 == 1;
          if (is_ahead && n % 8 == 1) options.segment_level = segment_level_for(shell, 16);
          QueryResult results[2];
          std::vector<Contact> found[2];
          for (const int with : {0, 1}) {
            options.cache = with == 1 ? &cache : nullptr;
            QueryResult& result = results[with];
            ASSERT_EQ(is_ahead ? traverse_ahead(shell, map, pose, options, motion, scratch, contacts, result)
                               : traverse(shell, map, pose, options, scratch, contacts, result),
                      Status::ok);
            found[with].assign(contacts.begin(), contacts.begin() + result.contacts);
          }
          const double farthest = double{options.contact_distance} + (is_ahead ? double{motion.shift.z} : 0);
          if (is_ahead && farthest >= end) {
            drop_those_that_cannot_arrive(oracle, farthest, found[1], found[0]);
          }
          ASSERT_TRUE(same_bytes(found[0], found[1])) << ground.name << ' ' << n;
          for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(results[0].force[axis], results[1].force[axis]);
          if (!found[0].empty()) {
            ASSERT_EQ(results[0].delta, results[1].delta);
          }
          for (std::uint32_t point = 0; n % 20 == 0 && point < shell.points; point += 97) {
            const Vec3 p = point_position(shell, point);
            ASSERT_GE(results[1].delta_bound + double{map.error}, oracle.penetration(moved(pose, {p.x, p.y, p.z})));
          }
          touching += !found[0].empty();
          tight += cache.region.is_tight;
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GT(touching, 100) << ground.name;
        if (!ground.is_level) continue;
        EXPECT_GT(tight, 50) << ground.name;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

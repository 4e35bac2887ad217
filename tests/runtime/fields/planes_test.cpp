// SPDX-License-Identifier: GPL-3.0-or-later
// The planes bound V, and queries find with them what they find without.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "cli/lab/oracle.h"
#include "runtime/contacts/find_hits.h"
#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using detail::find_plane;
using detail::PlaneAt;

struct MappedBody {
  const char* name;
  TriangleMesh mesh;
  bake::BakeOptions options;
};

// Round, flat, with edges inwards, two bodies with a gap of six voxels, thin against the voxels, and a wide band.
std::vector<MappedBody> bodies() {
  const auto options = [](double voxel_size, double band = 0) {
    bake::BakeOptions out;
    out.voxel_size = voxel_size;
    if (band > 0) out.band_inside = out.band_outside = band;
    return out;
  };
  const TriangleMesh plates = joined(make_box({0.05, 0.05, 0.004}), make_box({0.05, 0.05, 0.004}, {0, 0, 0.014}));
  return {{"torus", make_torus(0.1, 0.04, 40, 20), options(0.004)},
          {"box", make_box({0.05, 0.04, 0.03}), options(0.002)},
          {"gear", samples::make_gear(), options(0.001)},
          {"plates", plates, options(0.001)},
          {"sheet", make_box({0.05, 0.05, 0.0008}), options(0.002)},
          {"wide band", make_torus(0.1, 0.04, 40, 20), options(0.004, 7)}};
}

VoxelmapView scaled_map_of(const Asset& asset) {
  VoxelmapView map;
  EXPECT_EQ(asset.voxelmap(map, Field::scaled), Status::ok);
  EXPECT_NE(map.planes, nullptr);
  return map;
}

Vec3 random_place(Random& random, const VoxelmapView& map) {
  float p[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double low = map.origin[axis] + 0.5 * double{map.voxel_size};
    p[axis] = static_cast<float>(random.between(low, low + (map.dims[axis] - 1) * double{map.voxel_size}));
  }
  return {p[0], p[1], p[2]};
}

Pose random_pose_in(Random& random, const VoxelmapView& map) {
  Pose pose = random_pose(random, 0);
  const Vec3 place = random_place(random, map);
  pose.translation[0] = double{place.x};
  pose.translation[1] = double{place.y};
  pose.translation[2] = double{place.z};
  return pose;
}

TEST(Planes, BoundTheTrueVOutsideAndRejectNothingInside) {
  for (const MappedBody& one : bodies()) {
    const auto asset = baked(one.mesh, one.options);
    const VoxelmapView map = scaled_map_of(*asset);
    const lab::Oracle oracle(one.mesh);
    Random random(3);
    const double rounding = 1e-4 * double{map.voxel_size};
    std::vector<double> slack;
    for (int n = 0; n < 20000; ++n) {
      const Vec3 p = random_place(random, map);
      const PlaneAt at = find_plane(map, p);
      ASSERT_TRUE(at.in_grid);
      const double truth = oracle.penetration({p.x, p.y, p.z});
      if (truth >= 0) {
        ASSERT_GE(double{at.height}, -double{map.error}) << one.name;
        continue;
      }
      ASSERT_GE(double{at.height}, truth - rounding) << one.name << ' ' << p.x << ' ' << p.y << ' ' << p.z;
      if (truth > -8 * double{map.voxel_size}) slack.push_back((double{at.height} - truth) / double{map.voxel_size});
    }
    // And they are close enough to reject what is some voxels away.
    ASSERT_GT(slack.size(), 500U) << one.name;
    std::nth_element(slack.begin(), slack.begin() + std::ptrdiff_t(slack.size() / 2), slack.end());
    EXPECT_LT(slack[slack.size() / 2], 3) << one.name;
  }
}

// The nearest corner of the surface lies aside of the way to a face that slopes.
TEST(Planes, AreCloseOverAFaceThatSlopes) {
  const double angle = 0.4;
  Pose turned;
  turned.rotation[0] = turned.rotation[8] = std::cos(angle);
  turned.rotation[2] = std::sin(angle);
  turned.rotation[6] = -std::sin(angle);
  bake::BakeOptions options;
  options.voxel_size = 0.004;
  const auto asset = baked(moved(turned, make_box({0.2, 0.2, 0.04})), options);
  const VoxelmapView map = scaled_map_of(*asset);
  Random random(13);
  double most = 0;
  double sum = 0;
  constexpr int kPlaces = 5000;
  for (int n = 0; n < kPlaces; ++n) {
    const double off = random.between(3, 8);
    const auto [x, y, z] = moved(turned, {random.between(-0.1, 0.1), random.between(-0.1, 0.1), 0.04 + 0.004 * off});
    const PlaneAt at = find_plane(map, {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    ASSERT_TRUE(at.in_grid);
    const double slack = double{at.height} / 0.004 + off;
    most = std::max(most, slack);
    sum += slack;
  }
  EXPECT_LT(most, 2.5);
  EXPECT_LT(sum / kPlaces, 0.6);
}

// Points climb from random places to where V exceeds the plane most.
TEST(Planes, BoundTheFieldWherePointsCanBeInContactAlsoByClimbing) {
  for (const MappedBody& one : bodies()) {
    const auto asset = baked(one.mesh, one.options);
    const VoxelmapView map = scaled_map_of(*asset);
    const float end = detail::end_of_band(map.band_outer, map.voxel_size);
    const auto excess = [&](Vec3 p) {
      const PlaneAt at = find_plane(map, p);
      const detail::OwnPenetration own = detail::own_penetration(map, p, {});
      const bool can_touch = at.in_grid && own.sampled && own.v >= -end;
      return can_touch ? own.v - at.height : std::numeric_limits<float>::lowest();
    };
    Random random(5);
    int climbed = 0;
    for (int n = 0; n < 4000; ++n) {
      Vec3 best = random_place(random, map);
      float most = excess(best);
      if (most == std::numeric_limits<float>::lowest()) continue;
      ++climbed;
      for (float step = 2 * map.voxel_size; step > 0.05F * map.voxel_size; step /= 2) {
        for (int way = 0; way < 6; ++way) {
          Vec3 other = best;
          float* const axes[3] = {&other.x, &other.y, &other.z};
          *axes[way / 2] += way % 2 == 0 ? step : -step;
          if (const float e = excess(other); e > most) {
            most = e;
            best = other;
          }
        }
      }
      ASSERT_LE(most, 1e-4F * map.voxel_size) << one.name << ' ' << best.x << ' ' << best.y << ' ' << best.z;
    }
    EXPECT_GT(climbed, 100) << one.name;
  }
}

TEST(Planes, WideOnesBoundTheFieldAVoxelAroundTheirCell) {
  std::size_t wide = 0;
  for (const MappedBody& one : bodies()) {
    const auto asset = baked(one.mesh, one.options);
    const VoxelmapView map = scaled_map_of(*asset);
    const float end = detail::end_of_band(map.band_outer, map.voxel_size);
    Random random(7);
    for (int n = 0; n < 40000; ++n) {
      const Vec3 p = random_place(random, map);
      const PlaneAt at = find_plane(map, p);
      if (!at.in_grid || !at.plane.wide) continue;
      const float part = static_cast<float>(random.between(0, 1)) * map.voxel_size;
      const std::array<double, 9> turn = random.rotation();
      const Vec3 way{part * static_cast<float>(turn[0]), part * static_cast<float>(turn[1]),
                     part * static_cast<float>(turn[2])};
      const detail::OwnPenetration own = detail::own_penetration(map, detail::operator+(p, way), {});
      if (!own.sampled || own.v < -end) continue;
      ++wide;
      const int* const slope = at.plane.slope;
      ASSERT_LE(slope[0] * slope[0] + slope[1] * slope[1] + slope[2] * slope[2], kSlopeSteps * kSlopeSteps);
      const Vec3 gradient{static_cast<float>(slope[0]), static_cast<float>(slope[1]), static_cast<float>(slope[2])};
      ASSERT_LE(own.v, at.height + detail::dot(gradient, way) / kSlopeSteps + 1e-4F * map.voxel_size) << one.name;
    }
  }
  EXPECT_GT(wide, 3000U);
}

// A shell against a map, with its planes and without.
struct Both {
  VoxelmapView with, without;
  PointshellView shell;
  Scratch scratch;
  std::vector<Contact> found[2];
  QueryResult result[2];

  Both(const Asset& map, const Asset& points) : with(scaled_map_of(map)), without(with) {
    without.planes = nullptr;
    EXPECT_EQ(points.pointshell(shell), Status::ok);
    for (auto& contacts : found) contacts.resize(shell.points);
  }
  template <class Query>
  void ask(const Query& query) {
    for (int n = 0; n < 2; ++n) {
      ASSERT_EQ(query(n == 0 ? with : without, found[n], result[n]), Status::ok);
      found[n].resize(result[n].contacts);
    }
  }
  void clear() {
    for (auto& contacts : found) contacts.resize(shell.points);
  }
  [[nodiscard]] bool same() const {
    return std::ranges::equal(std::as_bytes(std::span(found[0])), std::as_bytes(std::span(found[1])));
  }
};

TEST(Planes, QueriesFindTheSameContactsAsWithout) {
  bake::BakeOptions fine;
  fine.voxel_size = 0.003;
  const auto sphere = baked(make_sphere(0.03, 4), fine);
  fine.voxel_size = 0.0005;  // points much closer than the voxels: wide planes are used
  const auto pebble = baked(make_sphere(0.004, 4), fine);
  for (const MappedBody& one : bodies()) {
    const auto asset = baked(one.mesh, one.options);
    for (const auto& shell : {sphere, pebble}) {
      for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
        hwy::SetSupportedTargetsForTest(left & -left);
        Both both(*asset, *shell);
        Random random(9);
        int touching = 0;
        for (int n = 0; n < 60; ++n) {
          const Pose pose = random_pose_in(random, both.with);
          QueryOptions options;
          const double voxels[] = {0, 0.3, 1.5, 6};
          options.contact_distance = static_cast<float>(voxels[n % 4]) * both.with.voxel_size;
          if (n % 3 == 1) options.segment_level = segment_level_for(both.shell, 16);
          both.clear();
          both.ask([&](const VoxelmapView& map, std::span<Contact> out, QueryResult& result) {
            return traverse(both.shell, map, pose, options, both.scratch, out, result);
          });
          ASSERT_TRUE(both.same()) << one.name << ' ' << n << ": " << both.result[0].contacts << " against "
                                   << both.result[1].contacts;
          ASSERT_EQ(both.result[0].force[2], both.result[1].force[2]);
          if (both.result[1].contacts > 0) {
            ASSERT_EQ(both.result[0].delta, both.result[1].delta);
          }
          // No point has a larger V than the bound and the field's error.
          ASSERT_GE(both.result[0].delta_bound + both.with.error, both.result[1].delta) << one.name;
          touching += both.result[0].contacts > 0;
        }
        hwy::SetSupportedTargetsForTest(0);
        EXPECT_GT(touching, 5) << one.name;
      }
    }
  }
}

// With a motion the planes may drop points that a look-up keeps, because it errs, but none that arrives.
TEST(Planes, AMotionsContactsAreThoseThatCanArrive) {
  bake::BakeOptions fine;
  fine.voxel_size = 0.003;
  const auto sphere = baked(make_sphere(0.03, 4), fine);
  for (const MappedBody& one : bodies()) {
    const auto asset = baked(one.mesh, one.options);
    const lab::Oracle oracle(one.mesh);
    Both both(*asset, *sphere);
    Random random(11);
    std::size_t kept = 0;
    for (int n = 0; n < 60; ++n) {
      const Pose pose = random_pose_in(random, both.with);
      const double voxels[] = {0.2, 1, 4};
      const float way = static_cast<float>(voxels[n % 3]) * both.with.voxel_size;
      const detail::RelativeMotion motion{{0, 0, way}, {}};
      QueryOptions options;
      both.clear();
      both.ask([&](const VoxelmapView& map, std::span<Contact> out, QueryResult& result) {
        return traverse_ahead(both.shell, map, pose, options, motion, both.scratch, out, result);
      });
      kept += both.found[0].size();
      std::size_t at = 0;
      for (const Contact& c : both.found[1]) {
        if (at < both.found[0].size() && both.found[0][at].point == c.point) {
          ASSERT_EQ(both.found[0][at++].penetration, c.penetration);
          continue;
        }
        ASSERT_LT(oracle.penetration({c.position.x, c.position.y, c.position.z}), -0.999 * double{way}) << one.name;
      }
      ASSERT_EQ(at, both.found[0].size()) << one.name;
    }
    EXPECT_GT(kept, 100U) << one.name;
  }
}

}  // namespace
}  // namespace vps::test

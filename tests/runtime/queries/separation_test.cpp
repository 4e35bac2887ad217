// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <limits>

#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/count_allocations.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr std::array<double, 3> kHalf{0.05, 0.03, 0.02};

// A box as voxelmap, a torus as pointshell.
struct Pair {
  TriangleMesh torus = make_torus(0.03, 0.012, 40, 24);
  std::shared_ptr<Asset> map_asset, shell_asset;
  VoxelmapView map;
  PointshellView shell;
  Scratch scratch;

  explicit Pair(Field field = Field::scaled) {
    map_asset = baked(make_box(kHalf), all_fields(0.002));
    shell_asset = baked(torus, all_fields(0.0015));
    EXPECT_EQ(map_asset->voxelmap(map, field), Status::ok);
    EXPECT_EQ(shell_asset->pointshell(shell), Status::ok);
  }
};

double box_depth(const std::array<double, 3>& p) {
  double outside = 0;
  double inside = -1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double q = std::abs(p[axis]) - kHalf[axis];
    outside += std::max(q, 0.0) * std::max(q, 0.0);
    inside = axis == 0 ? q : std::max(inside, q);
  }
  return -std::sqrt(outside) - std::min(inside, 0.0);
}

// The largest depth of a mesh's surface in the box, taken over points. Every surface point is closer than `reach` to
// one of them.
struct Truth {
  std::vector<std::array<double, 3>> points;
  double reach = 0;
  explicit Truth(const TriangleMesh& mesh) {
    constexpr int kParts = 5;
    for (const auto& t : mesh.triangles) {
      const auto& [a, b, c] = std::array{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
      for (int i = 0; i <= kParts; ++i) {
        for (int j = 0; i + j <= kParts; ++j) {
          std::array<double, 3> p;
          for (std::size_t k = 0; k < 3; ++k) p[k] = (a[k] * i + b[k] * j + c[k] * (kParts - i - j)) / kParts;
          points.push_back(p);
        }
      }
      for (const auto& [u, v] : {std::pair{a, b}, std::pair{b, c}, std::pair{c, a}}) {
        reach = std::max(reach, std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]) / kParts);
      }
    }
  }
  [[nodiscard]] double depth(const Pose& pose) const {
    double deepest = -std::numeric_limits<double>::max();
    for (const auto& p : points) deepest = std::max(deepest, box_depth(moved(pose, p)));
    return deepest;
  }
};

// A third within 3 mm of touching, a tenth up to 10 m away, the others at random depths or distances.
Pose pose_number(int n, Pair& s, Random& random) {
  Pose pose = random_pose(random, n % 10 == 9 ? 10 : n % 3 == 0 ? 0.02 : 0.09);
  if (n % 3 != 1 || n % 10 == 9) return pose;
  const double wanted = random.between(-0.003, 0.003);
  for (int step = 0; step < 3; ++step) {
    SeparationResult result;
    EXPECT_EQ(separation(s.shell, BoxField{{0.05F, 0.03F, 0.02F}}, pose, {}, s.scratch, result), Status::ok);
    const Vec3 d = result.direction;
    const double away = result.delta - wanted;
    pose.translation[0] += away * d.x;
    pose.translation[1] += away * d.y;
    pose.translation[2] += away * d.z;
  }
  return pose;
}

TEST(Separation, ItsIntervalHoldsTheTrueDepthNearFarAndDeep) {
  for (const Field field : {Field::scaled, Field::real, Field::layers}) {
    Pair s(field);
    const Truth truth(s.torus);
    Random random;
    int apart = 0;
    int deep = 0;
    double near_width = 0;
    for (int n = 0; n < 200; ++n) {
      const Pose pose = pose_number(n, s, random);
      SeparationResult result;
      ASSERT_EQ(separation(s.shell, s.map, pose, {}, s.scratch, result), Status::ok);
      const double depth = truth.depth(pose);
      ASSERT_LE(depth, result.upper) << n;
      ASSERT_GE(depth + truth.reach, result.lower) << n;
      ASSERT_LE(result.lower, result.delta) << n;
      ASSERT_LE(result.delta, result.delta_bound) << n;
      ASSERT_LE(result.delta_bound, result.upper) << n;
      // Beyond the band the error is at most the layers of a brick and the distance to its centre.
      if (n % 10 != 9) {
        ASSERT_LT(result.upper - result.lower, 20 * s.map.voxel_size) << n;
      }
      if (field != Field::layers && std::abs(depth) < 0.5 * s.map.band_inner) {
        near_width = std::max(near_width, result.upper - result.lower);
      }
      apart += depth < 0;
      deep += depth > s.map.band_inner;
    }
    EXPECT_GT(apart, 40);
    EXPECT_GT(deep, 40);
    if (field != Field::layers) {
      EXPECT_LT(near_width, s.shell.covering_radius + 2.1 * s.map.voxel_size * 0.25);
      EXPECT_GT(near_width, 0);
    }
  }
}

TEST(Separation, DeltaIsThatOfTheDeepestOfAllPoints) {
  for (const Field field : {Field::scaled, Field::real}) {
    Pair s(field);
    Random random;
    int in_band = 0;
    std::uint64_t tested = 0;
    for (int n = 0; n < 300; ++n) {
      const Pose pose = pose_number(n, s, random);
      double deepest = -1e30;
      for (std::uint32_t i = 0; i < s.shell.points; ++i) {
        const Vec3 p = point_position(s.shell, i);
        const auto at = moved(pose, {p.x, p.y, p.z});
        const Vec3 q{static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])};
        deepest = std::max<double>(deepest, penetration(s.map, q, {}));
      }
      SeparationResult result;
      SeparationOptions options;
      options.guess = static_cast<std::uint32_t>(n) % s.shell.points;
      ASSERT_EQ(separation(s.shell, s.map, pose, options, s.scratch, result), Status::ok);
      if (std::abs(deepest) > s.map.band_outer - 1.2 * s.map.voxel_size) continue;
      ++in_band;
      ASSERT_NEAR(result.delta, deepest, 1e-4 * s.map.voxel_size) << n;
      ASSERT_EQ(result.delta, penetration(s.map, result.position, {}));
      const Vec3 p = point_position(s.shell, result.point);
      const auto at = moved(pose, {p.x, p.y, p.z});
      ASSERT_NEAR(result.position.x, at[0], 1e-7);
      ASSERT_NEAR(result.position.y, at[1], 1e-7);
      ASSERT_NEAR(result.position.z, at[2], 1e-7);
      tested += result.points_tested;
    }
    EXPECT_GT(in_band, 40);
    EXPECT_LT(tested, std::uint64_t{s.shell.points} * static_cast<std::uint64_t>(in_band) / 5);
  }
}

TEST(Separation, BeyondTheBandInsideNoPointHasALargerV) {
  const auto body = baked(make_torus(0.03, 0.012, 40, 24), all_fields(0.0015));
  VoxelmapView map;
  PointshellView shell;
  ASSERT_EQ(body->voxelmap(map, Field::scaled), Status::ok);
  ASSERT_EQ(body->pointshell(shell), Status::ok);
  Scratch scratch;
  for (const bool far_grid : {true, false}) {
    if (!far_grid) map.far = {};
    Random random;
    int deep = 0;
    for (int n = 0; n < 200; ++n) {
      const Pose pose = random_pose(random, 0.03);
      float deepest = std::numeric_limits<float>::lowest();
      for (std::uint32_t i = 0; i < shell.points; ++i) {
        const Vec3 p = point_position(shell, i);
        const auto at = moved(pose, {p.x, p.y, p.z});
        const Vec3 q{static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])};
        deepest = std::max(deepest, penetration(map, q, {}));
      }
      if (deepest < map.band_inner - map.voxel_size) continue;
      ++deep;
      SeparationResult result;
      ASSERT_EQ(separation(shell, map, pose, {}, scratch, result), Status::ok);
      EXPECT_NEAR(penetration(map, result.position, {}), deepest, 1e-4 * map.voxel_size) << n;
    }
    EXPECT_GT(deep, 50);
  }
}

TEST(Separation, ARealFieldsErrorHidesNoDeeperPoint) {
  const auto shell_asset = baked(make_sphere(0.05, 4), all_fields(0.1 / 60));
  const auto map_asset = baked(make_box({0.05, 0.05, 0.05}), all_fields(0.1 / 60));
  PointshellView shell;
  VoxelmapView map;
  ASSERT_EQ(shell_asset->pointshell(shell), Status::ok);
  ASSERT_EQ(map_asset->voxelmap(map, Field::real), Status::ok);
  Scratch scratch;
  Random random;
  int in_band = 0;
  for (int n = 0; n < 300; ++n) {
    Pose pose = random_pose(random, 0.07);
    SeparationResult result;
    // Moves the shell to within a voxel of the surface, where the interpolation error differs between edges and faces.
    const double wanted = random.between(-1, 1) * map.voxel_size;
    for (int step = 0; step < 4; ++step) {
      ASSERT_EQ(separation(shell, map, pose, {}, scratch, result), Status::ok);
      if (step == 3) break;
      const double away = result.delta - wanted;
      pose.translation[0] += away * result.direction.x;
      pose.translation[1] += away * result.direction.y;
      pose.translation[2] += away * result.direction.z;
    }
    float deepest = std::numeric_limits<float>::lowest();
    for (std::uint32_t i = 0; i < shell.points; ++i) {
      const Vec3 p = point_position(shell, i);
      const auto at = moved(pose, {p.x, p.y, p.z});
      deepest = std::max(
          deepest,
          penetration(map, {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])}, {}));
    }
    if (std::abs(deepest) > 1.3F * map.voxel_size) continue;
    ++in_band;
    EXPECT_NEAR(result.delta, deepest, 1e-4 * map.voxel_size) << n;
  }
  EXPECT_GT(in_band, 50);
}

// Compares delta with the deepest point. Along `direction`, V must fall by the distance moved.
template <class AnyField>
void expect_exact(Pair& s, const AnyField& field) {
  Random random;
  for (int n = 0; n < 200; ++n) {
    const Pose pose = pose_number(n, s, random);
    double deepest = -1e30;
    for (std::uint32_t i = 0; i < s.shell.points; ++i) {
      const Vec3 p = point_position(s.shell, i);
      const auto at = moved(pose, {p.x, p.y, p.z});
      const Vec3 q{static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])};
      deepest = std::max<double>(deepest, penetration(field, q));
    }
    SeparationResult result;
    ASSERT_EQ(separation(s.shell, field, pose, {}, s.scratch, result), Status::ok);
    const double rounding = n % 10 == 9 ? 1e-4 : 1e-6;
    ASSERT_NEAR(result.delta, deepest, rounding) << n;
    ASSERT_GE(result.upper, deepest + s.shell.covering_radius);
    ASSERT_LE(result.lower, deepest);
    const float step = n % 10 == 9 ? 0.1F : 1e-4F;
    const Vec3 p = result.position;
    const Vec3 d = result.direction;
    ASSERT_NEAR(penetration(field, {p.x + step * d.x, p.y + step * d.y, p.z + step * d.z}), result.delta - step,
                0.01 * step)
        << n;
  }
}

TEST(Separation, AnalyticFieldsAreExact) {
  Pair s;
  expect_exact(s, BoxField{{0.05F, 0.03F, 0.02F}});
  expect_exact(s, SphereField{0.03F});
  expect_exact(s, HalfSpaceField{{0.6F, 0, 0.8F}, 0.01F});
  for (const auto profile :
       {RevolvedField::Profile::capsule, RevolvedField::Profile::cylinder, RevolvedField::Profile::cone}) {
    expect_exact(s, RevolvedField{profile, 0.03F, 0.04F, 0.002F});
  }
  // A wedge: V is exact, the distance is not.
  const HalfSpaceField planes[] = {{{0.6F, 0, 0.8F}, 0.01F}, {{-0.6F, 0, 0.8F}, 0.02F}, {{0, 0, -1}, 0.03F}};
  expect_exact(s, PolytopeField{planes});
}

TEST(Separation, APolytopeTellsADistanceOnlyWhereItsPlanesDo) {
  Pair s;
  const HalfSpaceField planes[] = {{{1, 0, 0}, 0.1F}, {{0, 1, 0}, 0.1F}, {{0, 0, 1}, 0.1F}};
  Pose pose;
  pose.translation[0] = 1;
  SeparationResult result;
  ASSERT_EQ(separation(s.shell, PolytopeField{planes}, pose, {}, s.scratch, result), Status::ok);
  EXPECT_NEAR(result.lower, result.delta, 1e-3);
  pose.translation[1] = 1;
  ASSERT_EQ(separation(s.shell, PolytopeField{planes}, pose, {}, s.scratch, result), Status::ok);
  EXPECT_EQ(result.lower, -std::numeric_limits<double>::infinity());
  EXPECT_NEAR(result.upper, -0.85, 0.02);
}

TEST(Separation, ToleranceSavesWorkAndIsKept) {
  Pair s;
  Random random;
  std::uint32_t exact_points = 0;
  std::uint32_t rough_points = 0;
  for (int n = 0; n < 200; ++n) {
    const Pose pose = pose_number(n, s, random);
    SeparationResult exact;
    SeparationResult rough;
    SeparationOptions options;
    options.tolerance = 0.003F;
    ASSERT_EQ(separation(s.shell, s.map, pose, {}, s.scratch, exact), Status::ok);
    ASSERT_EQ(separation(s.shell, s.map, pose, options, s.scratch, rough), Status::ok);
    ASSERT_LE(rough.delta_bound, exact.delta_bound + options.tolerance + 1e-6);
    ASSERT_GE(rough.upper + 1e-6, exact.lower);
    exact_points += exact.points_tested;
    rough_points += rough.points_tested;
  }
  EXPECT_LT(rough_points, 0.8 * exact_points);
}

// Also with narrow vectors, which fill their chunks of children more often.
TEST(Separation, ARoughSearchBoundsThePointsItPassedOver) {
  Pair s;
  const BoxField box{{0.05F, 0.03F, 0.02F}};
  for (std::int64_t target = 1; target > 0; target <<= 1) {
    if ((hwy::SupportedTargets() & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    Random random;
    for (int n = 0; n < 100; ++n) {
      const Pose pose = pose_number(n, s, random);
      const double rounding = n % 10 == 9 ? 1e-4 : 1e-6;
      SeparationResult exact;
      ASSERT_EQ(separation(s.shell, box, pose, {}, s.scratch, exact), Status::ok);
      for (const float tolerance : {0.0003F, 0.001F, 0.003F, 0.01F}) {
        SeparationResult rough;
        ASSERT_EQ(separation(s.shell, box, pose, {tolerance, 0}, s.scratch, rough), Status::ok);
        ASSERT_GE(rough.delta_bound, exact.delta - rounding) << n;
        ASSERT_GE(rough.delta, exact.delta - tolerance - rounding) << n;
      }
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(Separation, EveryInstructionSetGivesTheSameAnswer) {
  Pair s;
  Random random;
  for (int n = 0; n < 60; ++n) {
    const Pose pose = pose_number(n, s, random);
    std::vector<SeparationResult> results;
    for (std::int64_t target = 1; target > 0; target <<= 1) {
      if ((hwy::SupportedTargets() & target) == 0) continue;
      hwy::SetSupportedTargetsForTest(target);
      results.emplace_back();
      ASSERT_EQ(separation(s.shell, s.map, pose, {}, s.scratch, results.back()), Status::ok);
      hwy::SetSupportedTargetsForTest(0);
      ASSERT_NEAR(results.back().delta_bound, results[0].delta_bound, 1e-4 * s.map.voxel_size) << n;
    }
  }
}

TEST(Separation, BadUseGetsAStatus) {
  Pair s;
  SeparationResult result;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [&](const Pose& pose, const SeparationOptions& options) {
    return separation(s.shell, s.map, pose, options, s.scratch, result);
  };
  EXPECT_EQ(with(pose_at(0, nan, 0), {}), Status::bad_pose);
  EXPECT_EQ(with(pose_at(0, 0, 1e300), {}), Status::bad_pose);
  EXPECT_EQ(with(pose_at(0, 0, 1e11), {}), Status::ok);
  Pose mirror;
  mirror.rotation[8] = -1;
  EXPECT_EQ(with(mirror, {}), Status::bad_pose);
  SeparationOptions options;
  options.tolerance = -1;
  EXPECT_EQ(with({}, options), Status::bad_argument);
  options.tolerance = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(with({}, options), Status::bad_argument);
  options = {};
  options.guess = s.shell.points;
  EXPECT_EQ(with({}, options), Status::bad_argument);
  EXPECT_EQ(separation(PointshellView{}, s.map, {}, {}, s.scratch, result), Status::missing_part);
  EXPECT_EQ(separation(s.shell, VoxelmapView{}, {}, {}, s.scratch, result), Status::missing_part);
  const SphereField shapeless{std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(separation(s.shell, shapeless, {}, {}, s.scratch, result), Status::bad_argument);
}

#ifndef VPS_SANITIZE
TEST(Separation, AllocatesNothingOnceItsScratchHasGrown) {
  Pair s;
  s.scratch.reserve(s.shell);
  Random random;
  SeparationResult result;
  const std::size_t before = allocations;
  for (int n = 0; n < 50; ++n) {
    (void)separation(s.shell, s.map, pose_number(n, s, random), {}, s.scratch, result);
  }
  EXPECT_EQ(allocations, before);
}
#endif

}  // namespace
}  // namespace vps::test

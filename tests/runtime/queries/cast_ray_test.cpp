// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

Vec3 along(const Ray& ray, double way) {
  return {static_cast<float>(ray.origin.x + way * ray.direction.x),
          static_cast<float>(ray.origin.y + way * ray.direction.y),
          static_cast<float>(ray.origin.z + way * ray.direction.z)};
}

Ray random_ray(Random& random, double from, double to) {
  const auto r = random.rotation();
  Ray ray;
  ray.origin = {static_cast<float>(from * r[0]), static_cast<float>(from * r[1]), static_cast<float>(from * r[2])};
  double d[3];
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    d[axis] = random.between(-to, to) - from * r[axis];
    size += d[axis] * d[axis];
  }
  size = std::sqrt(size);
  ray.direction = {static_cast<float>(d[0] / size), static_cast<float>(d[1] / size), static_cast<float>(d[2] / size)};
  return ray;
}

// Compares with the field's values at small steps along the ray.
TEST(CastRay, StopsWhereTheFieldFirstTurnsPositive) {
  const auto asset = baked(make_torus(0.1, 0.04, 40, 20), all_fields(0.006));
  for (const Field field : {Field::scaled, Field::real}) {
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
    Random random;
    const double step = 0.02 * map.voxel_size;
    int hits = 0;
    for (int n = 0; n < 300; ++n) {
      const Ray ray = random_ray(random, n % 4 == 0 ? 0.1 : 0.25, 0.12);
      RayHit hit;
      ASSERT_EQ(cast_ray(map, ray, {}, hit), Status::ok);
      double first = 0;
      while (first < 0.6 && !(penetration(map, along(ray, first), {}) >= 0)) first += step;
      if (first < 0.6) {
        ASSERT_TRUE(hit.hit) << n;
        ASSERT_LE(hit.distance, first + 1e-6) << n;
      }
      if (!hit.hit) continue;
      ++hits;
      ASSERT_LT(hit.steps, 300U);
      ASSERT_NEAR(hit.position.x, along(ray, hit.distance).x, 1e-6);
      // The steps missed a root, or the field jumps between bricks of different levels.
      if (hit.distance > 0 && first - hit.distance > step) {
        ASSERT_GE(penetration(map, hit.position, {}), -0.01 * map.voxel_size) << n;
      }
    }
    EXPECT_GT(hits, 100);
    EXPECT_LT(hits, 290);
  }
}

TEST(CastRay, HitsABoxWithinTheErrorOfItsField) {
  const auto asset = baked(make_box({0.1, 0.08, 0.06}), all_fields(0.004));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  const double error = std::max(map.lambda, map.error);
  Random random;
  int hits = 0;
  for (int n = 0; n < 1000; ++n) {
    // From next to the box to a kilometre away.
    const Ray ray = random_ray(random, n % 3 == 0 ? 1000 : 0.3, 0.12);
    double begin = 0;
    double end = 1e9;
    double cosine = 1;
    const float o[3] = {ray.origin.x, ray.origin.y, ray.origin.z};
    const float d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
    const double half[3] = {0.1, 0.08, 0.06};
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (-std::copysign(half[axis], d[axis]) - o[axis]) / d[axis];
      const double b = (std::copysign(half[axis], d[axis]) - o[axis]) / d[axis];
      if (a > begin) {
        begin = a;
        cosine = std::abs(d[axis]);
      }
      end = std::min(end, b);
    }
    if (cosine < 0.2 || std::abs(end - begin) < 20 * error) continue;  // grazes
    RayHit hit;
    ASSERT_EQ(cast_ray(map, ray, {}, hit), Status::ok);
    ASSERT_EQ(hit.hit, begin < end) << n;
    if (!hit.hit) continue;
    ++hits;
    const double rounding = n % 3 == 0 ? 1e-3 : 1e-6;
    ASSERT_NEAR(hit.distance, begin, error / cosine + rounding) << n;
    const Vec3 normal = hit.outward_normal;
    if (normal.x * normal.x + normal.y * normal.y + normal.z * normal.z > 0) {
      ASSERT_LT(normal.x * d[0] + normal.y * d[1] + normal.z * d[2], 0);
    }
  }
  EXPECT_GT(hits, 300);
}

TEST(CastRay, NeverPassesAThinWall) {
  // A tenth of a voxel thick.
  const auto asset = baked(make_box({0.1, 0.1, 0.0001}), all_fields(0.002));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map, Field::real), Status::ok);
  Random random;
  for (int n = 0; n < 500; ++n) {
    Ray ray = random_ray(random, 0, 0.08);
    ray.direction = {random.next() < 0.5 ? 0.0F : 0.6F, 0, 0};
    ray.direction.z = ray.direction.x == 0 ? -1 : -0.8F;
    const auto target = [&] { return static_cast<float>(random.between(-0.09, 0.09)); };
    const Vec3 at{target(), target(), 0};
    ray.origin = {at.x - 0.5F * ray.direction.x, at.y, -0.5F * ray.direction.z};
    RayHit hit;
    ASSERT_EQ(cast_ray(map, ray, {}, hit), Status::ok);
    ASSERT_TRUE(hit.hit) << n;
    ASSERT_NEAR(hit.position.z, 0, 0.002);
  }
}

TEST(CastRay, EndsAtItsLargestDistanceAndStartsInside) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.005));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  RayHit hit;
  ASSERT_EQ(cast_ray(map, {{0, 0, 0.3F}, {0, 0, -1}, 0.19F}, {}, hit), Status::ok);
  EXPECT_FALSE(hit.hit);
  ASSERT_EQ(cast_ray(map, {{0, 0, 0.3F}, {0, 0, -1}, 0.21F}, {}, hit), Status::ok);
  EXPECT_TRUE(hit.hit);
  EXPECT_NEAR(hit.distance, 0.2, 2e-4);
  EXPECT_NEAR(hit.outward_normal.z, 1, 1e-4);
  ASSERT_EQ(cast_ray(map, {{0, 0, 0.3F}, {0, 0, 1}, 10}, {}, hit), Status::ok);
  EXPECT_FALSE(hit.hit);
  for (const Vec3 inside : {Vec3{0, 0, 0}, Vec3{0.098F, 0, 0}}) {
    ASSERT_EQ(cast_ray(map, {inside, {0, 0, 1}, 0}, {}, hit), Status::ok);
    EXPECT_TRUE(hit.hit);
    EXPECT_EQ(hit.distance, 0);
  }
}

// Seen from so far, a voxel is smaller than the rounding of a ray's place.
TEST(CastRay, AFarRayTakesNoMoreStepsThanTheGridHasCells) {
  const std::vector<std::uint32_t> roots(64, kFarOutside);
  VoxelmapView empty;
  empty.field = Field::scaled;
  empty.element = ElementType::i8;
  empty.field_roots = roots.data();
  for (int axis = 0; axis < 3; ++axis) {
    empty.dims[axis] = 64;
    empty.root_dims[axis] = 4;
  }
  empty.voxel_size = 1e-10F;
  Random random;
  for (int n = 0; n < 200; ++n) {
    const auto r = random.rotation();
    const Ray ray{{},
                  {static_cast<float>(r[0]), static_cast<float>(r[1]), static_cast<float>(r[2])},
                  std::numeric_limits<float>::infinity()};
    // The middle of the grid lies on the ray.
    const double size = std::hypot(ray.direction.x, ray.direction.y, ray.direction.z);
    const double direction[3] = {ray.direction.x / size, ray.direction.y / size, ray.direction.z / size};
    for (int axis = 0; axis < 3; ++axis) {
      empty.origin[axis] = 1e6 * direction[axis] - 32 * double{empty.voxel_size};
    }
    RayHit hit;
    ASSERT_EQ(cast_ray(empty, ray, {}, hit), Status::ok);
    ASSERT_FALSE(hit.hit);
    ASSERT_LT(hit.steps, 20U) << n;
  }
}

TEST(CastRay, BadUseGetsAStatus) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.01));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  VoxelmapView layers;
  ASSERT_EQ(asset->voxelmap(layers, Field::layers), Status::ok);
  RayHit hit;
  EXPECT_EQ(cast_ray(VoxelmapView{}, {}, {}, hit), Status::missing_part);
  EXPECT_EQ(cast_ray(layers, {}, {}, hit), Status::missing_part);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto refused = [&](const Ray& ray) { return cast_ray(map, ray, {}, hit) == Status::bad_argument; };
  for (const Vec3 o : {Vec3{nan, 0, 0}, Vec3{0, nan, 0}, Vec3{0, 0, nan}, Vec3{INFINITY, 0, 0}, Vec3{0, 2e6F, 0}}) {
    EXPECT_TRUE(refused({o, {0, 0, 1}, 1}));
  }
  for (const Vec3 d : {Vec3{0, 0, 0}, Vec3{0, 0, 1.1F}, Vec3{nan, 0, 1}, Vec3{INFINITY, 0, 0}}) {
    EXPECT_TRUE(refused({{}, d, 1}));
  }
  for (const float most : {-1.0F, nan}) EXPECT_TRUE(refused({{}, {0, 0, 1}, most}));
  for (const float tolerance : {0.0F, -1.0F, nan}) {
    EXPECT_EQ(cast_ray(map, {}, {tolerance}, hit), Status::bad_argument);
  }
}

}  // namespace
}  // namespace vps::test

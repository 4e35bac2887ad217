// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "runtime/fields/penetration.h"
#include "tests/support/baked.h"
#include "tests/support/oracle.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

struct Case {
  Field field;
  double band_error_vx;  // largest error near the surface, with the ideal normal
};

// Compares V with CGAL's distance. In the band V is within the field's error. Elsewhere sampled fields have the right
// sign, and V is within the far grid's error.
void expect_penetration(const TriangleMesh& mesh, double s, const Case& c) {
  const auto asset = baked(mesh, all_fields(s));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map, c.field), Status::ok);
  const Oracle oracle(mesh);
  Random random;
  int in_band = 0;
  for (int n = 0; n < 20000; ++n) {
    const AssetInfo& info = asset->info();
    double p[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      p[axis] = random.between(info.bounds_min[axis] - 12 * s, info.bounds_max[axis] + 12 * s);
    }
    const Vec3 point{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    const std::array<double, 3> exact = {point.x, point.y, point.z};
    const double truth = oracle.penetration(exact);
    // The ideal inward normal of a touching shell points against the gradient of V.
    const double h = 1e-6;
    Vec3 normal;
    float* const n_axis[3] = {&normal.x, &normal.y, &normal.z};
    double length = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      auto q = exact;
      q[axis] += h;
      const double slope = (oracle.penetration(q) - truth) / h;
      *n_axis[axis] = static_cast<float>(-slope);
      length += slope * slope;
    }
    if (std::abs(length - 1) > 0.1) continue;  // on a ridge of the field
    const float v = penetration(map, point, normal);
    ASSERT_LE(truth, penetration_bound(map, point) + 1e-6 * s) << "sphere tests would miss a contact";
    if (std::abs(truth) < (2.5 - 0.87) * s) {
      ASSERT_NEAR(v, truth, c.band_error_vx * s);
      ++in_band;
    } else if (c.field != Field::layers) {
      ASSERT_EQ(v > 0, truth > 0);
      if (truth > -info.far_range) {
        ASSERT_NEAR(v, truth, info.far_error.bound);
      } else {
        ASSERT_LE(v, -info.far_range + info.far_error.bound);
      }
    }
  }
  EXPECT_GT(in_band, 500);
}

TEST(Penetration, OfASphereIsWithinTheErrorOfItsField) {
  const TriangleMesh sphere = make_sphere(0.1, 4);
  expect_penetration(sphere, 0.01, {Field::real, 0.1});
  expect_penetration(sphere, 0.01, {Field::scaled, 0.12});
  expect_penetration(sphere, 0.01, {Field::layers, 1.75});
}

TEST(Penetration, OfATorusIsWithinTheErrorOfItsField) {
  const TriangleMesh torus = make_torus(0.1, 0.04, 60, 30);
  expect_penetration(torus, 0.006, {Field::real, 0.11});
  expect_penetration(torus, 0.006, {Field::scaled, 0.13});
}

TEST(Penetration, OfABoxIsExactNextToAFace) {
  const auto asset = baked(make_box({0.1, 0.08, 0.06}), all_fields(0.01));
  // Flat faces are stored in steps of 2 lambda.
  for (const auto& [field, error] : {std::pair{Field::real, 1e-6}, std::pair{Field::scaled, asset->info().lambda}}) {
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
    for (double depth = -0.015; depth <= 0.015; depth += 0.0007) {
      const Vec3 p{static_cast<float>(0.1 - depth), 0.013F, 0.007F};
      EXPECT_NEAR(penetration(map, p, {1, 0, 0}), depth, error + 1e-7);
    }
  }
}

TEST(OutwardNormal, OfASpherePointsAwayFromItsCentre) {
  const auto asset = baked(make_sphere(0.1, 5), all_fields(0.005));
  for (const auto& [field, degrees] : {std::pair{Field::real, 5.0}, std::pair{Field::scaled, 5.0}}) {
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
    Random random;
    for (int n = 0; n < 2000; ++n) {
      const auto r = random.rotation();
      const double d = random.between(0.097, 0.103);
      const Vec3 p{static_cast<float>(d * r[0]), static_cast<float>(d * r[1]), static_cast<float>(d * r[2])};
      const Vec3 normal = outward_normal(map, p);
      const double cosine = normal.x * r[0] + normal.y * r[1] + normal.z * r[2];
      ASSERT_GT(cosine, std::cos(degrees * M_PI / 180)) << static_cast<int>(field);
    }
  }
}

TEST(OutwardNormal, IsZeroOnlyWhereTheFieldHasNoSlope) {
  const auto asset = baked(make_box({0.1, 0.1, 0.015}), all_fields(0.01));
  for (const Field field : {Field::scaled, Field::real}) {
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
    const Vec3 far = outward_normal(map, {5, 0, 0});
    EXPECT_FLOAT_EQ(far.x, 1);
    const Vec3 deep = outward_normal(map, {0.01F, 0, 0.004F});
    EXPECT_GT(deep.z, 0.9F);
    // In the middle either side is nearest, or none.
    const Vec3 middle = outward_normal(map, {0.01F, 0, 0});
    EXPECT_LT(std::hypot(middle.x, middle.y), 0.3F);
  }
}

TEST(Penetration, FarOutsideTheGridItIsTheDistanceToTheBounds) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.01));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  EXPECT_FLOAT_EQ(penetration(map, {10.1F, 0, 0}, {1, 0, 0}), -10);
  EXPECT_FLOAT_EQ(penetration_bound(map, {10.1F, 0, 0}), -10);
  EXPECT_FLOAT_EQ(penetration_bound(map, {3.1F, 4.1F, 0}), -5);
}

TEST(Penetration, NotANumberIsOutside) {
  const auto asset = baked(make_box({0.1, 0.1, 0.1}), all_fields(0.01));
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(penetration(map, {nan, 0, 0}, {1, 0, 0}) > 0);
  EXPECT_FALSE(penetration(map, {0, nan, nan}, {1, 0, 0}) > 0);
}

// Deep inside two boxes, around them, and in the gap of 20 voxels between them.
TEST(Penetration, BricksWithoutLayersKnowTheirSide) {
  bake::BakeOptions options;
  options.voxel_size = 0.002;
  options.layers = true;
  options.scaled = options.pointshell = false;
  const TriangleMesh mesh = joined(make_box({0.1, 0.1, 0.1}), make_box({0.1, 0.1, 0.1}, {0.24, 0, 0}));
  const auto asset = baked(mesh, options);
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map, Field::layers), Status::ok);
  const Oracle oracle(mesh);
  Random random(3);
  std::size_t without[2] = {};
  for (int n = 0; n < 8000; ++n) {
    const auto x = random.between(-0.12, 0.36);
    const Vec3 p{static_cast<float>(x), static_cast<float>(random.between(-0.12, 0.12)),
                 static_cast<float>(random.between(-0.12, 0.12))};
    const detail::Voxel voxel = detail::find_voxel(map, p);
    if (!voxel.in_grid || detail::has_layer(map, voxel)) continue;
    const bool inside = oracle.penetration({p.x, p.y, p.z}) > 0;
    ASSERT_EQ(detail::own_penetration(map, p, {}).v >= 0, inside) << p.x << ' ' << p.y << ' ' << p.z;
    ++without[inside];
  }
  EXPECT_GT(without[0], 100U);
  EXPECT_GT(without[1], 100U);
}

}  // namespace
}  // namespace vps::test

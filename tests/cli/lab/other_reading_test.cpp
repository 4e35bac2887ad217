// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/other_reading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cli/lab/ours.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using lab::PairAnswer;
using lab::Reading;

constexpr double kVoxel = 0.003;

std::shared_ptr<Asset> torus_with(Field field) {
  bake::BakeOptions options;
  options.voxel_size = kVoxel;
  options.layers = field == Field::layers;
  options.scaled = field == Field::scaled;
  options.real = field == Field::real;
  return baked(make_torus(0.05, 0.02, 60, 30), options);
}

Pose side_by_side(double distance) {
  Pose pose;
  pose.translation[0] = distance;
  return pose;
}

TEST(OtherReading, ReadAsQueriesDoItIsTraverse) {
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    const auto asset = torus_with(field);
    const Pose pose = side_by_side(0.136);
    const PairAnswer slow = lab::read_otherwise(asset, Reading::queries)->query(pose);
    const PairAnswer fast = lab::our_traverse(asset)->query(pose);
    EXPECT_TRUE(std::isnan(slow.microseconds));
    ASSERT_GT(fast.contacts, 0U);
    EXPECT_NEAR(slow.depth, fast.depth, 1e-4 * kVoxel);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(slow.force[i], fast.force[i], 1e-3 * std::abs(fast.force[0]));
      EXPECT_NEAR(slow.torque[i], fast.torque[i], 1e-3 * 0.05 * std::abs(fast.force[0]));
    }
  }
}

TEST(OtherReading, OnAFlatFaceEquationsFourAndFiveAreExact) {
  bake::BakeOptions options;
  options.voxel_size = kVoxel;
  options.real = true;
  options.scaled = false;
  const TriangleMesh box = make_box({0.05, 0.05, 0.05});
  const auto real = baked(box, options);
  options.real = false;
  options.scaled = true;
  const auto scaled = baked(box, options);
  VoxelmapView map;
  for (const auto& asset : {real, scaled}) {
    ASSERT_EQ(asset->voxelmap(map), Status::ok);
    for (const double depth : {-0.004, -0.0011, 0.0, 0.0023}) {
      const Vec3 p{0.0071F, -0.0032F, float(0.05 - depth)};
      // The inward normal of a shell that touches the top points upwards.
      EXPECT_NEAR(lab::read_penetration(map, Reading::nearest, p, {0, 0, 1}), depth, 0.03 * kVoxel);
    }
  }
}

TEST(OtherReading, LayersBetweenVoxelCentresAreTheirMean) {
  const auto asset = torus_with(Field::layers);
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map), Status::ok);
  // Near the outermost circle: at a voxel's centre the value is the layer's, half way to the next centre the mean.
  const auto centre = [&](int x) {
    const auto at = [&](int axis, double target) {
      const double cell = std::floor((target - map.origin[axis]) / double(map.voxel_size));
      return map.origin[axis] + (cell + 0.5) * double(map.voxel_size);
    };
    return Vec3{float(at(0, 0.07) + x * double(map.voxel_size)), float(at(1, 0)), float(at(2, 0))};
  };
  const auto read = [&](Vec3 p) { return lab::read_penetration(map, Reading::trilinear, p, {1, 0, 0}); };
  const auto layer = [&](Vec3 p) { return std::round(read(p) / kVoxel); };
  for (int x = -1; x < 1; ++x) {
    const Vec3 a = centre(x);
    const Vec3 b = centre(x + 1);
    EXPECT_NEAR(read(a), layer(a) * kVoxel, 1e-3 * kVoxel);
    const Vec3 middle{(a.x + b.x) / 2, a.y, a.z};
    EXPECT_NEAR(read(middle), (read(a) + read(b)) / 2, 1e-3 * kVoxel);
  }
  EXPECT_NE(layer(centre(-1)), layer(centre(1)));
}

}  // namespace
}  // namespace vps::test

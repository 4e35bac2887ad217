// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/fields/placed_field.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <iterator>
#include <utility>

#include "sample_meshes/shapes.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"

namespace vps::test {
namespace {

using namespace detail;
using namespace samples;

Places random_places(Random& random, std::uint32_t count) {
  Places places;
  const auto any = [&] { return static_cast<float>(random.between(-0.07, 0.07)); };
  while (places.count < count) {
    const float x = any();
    const float y = any();
    places.push({x, y, any()});
  }
  return places;
}

// Every number of vectors, whole ones and others.
constexpr std::uint32_t kCounts[] = {1, 4, 5, 8, 9, 16, 17, 24, 32, 33, 48, 64, 79, Places::kMost};

TEST(PlacedField, TwoBodiesSideBySideHaveTheValuesOfEachAlone) {
  bake::BakeOptions options;
  options.voxel_size = 0.002;
  const auto ball = baked(make_sphere(0.05, 3), options);
  const auto torus = baked(make_torus(0.04, 0.012, 32, 16), options);
  VoxelmapView first;
  VoxelmapView second;
  ASSERT_EQ(ball->voxelmap(first), Status::ok);
  ASSERT_EQ(torus->voxelmap(second), Status::ok);
  const SphereField sphere{0.03F};
  Random random;
  const std::int64_t supported = hwy::SupportedTargets();
  for (std::int64_t target = 1; target > 0; target <<= 1) {
    if ((supported & target) == 0) continue;
    hwy::SetSupportedTargetsForTest(target);
    for (const std::uint32_t count : kCounts) {
      const Pose pose = random_pose(random, 0.02);
      const PlacedField a(first, pose);
      const PlacedField b(second, Pose());
      const PlacedField c(sphere, pose);
      const Places places = random_places(random, count);
      for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a), std::pair(&a, &c), std::pair(&c, &a)}) {
        Values alone;
        Values others_alone;
        one->penetrations(places, alone);
        other->penetrations(places, others_alone);
        Values own;
        Values others;
        one->penetrations_beside(*other, places, own, others);
        for (std::uint32_t i = 0; i < count; ++i) {
          ASSERT_EQ(own[i], alone[i]) << count << ' ' << hwy::TargetName(target);
          ASSERT_EQ(others[i], others_alone[i]) << count << ' ' << hwy::TargetName(target);
        }
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(PlacedField, ManyPlacesHaveTheValuesOfEachPlace) {
  bake::BakeOptions options;
  options.voxel_size = 0.002;
  const auto torus = baked(make_torus(0.04, 0.012, 32, 16), options);
  VoxelmapView map;
  ASSERT_EQ(torus->voxelmap(map), Status::ok);
  Random random;
  int in_band = 0;
  for (int n = 0; n < 20 * int(std::size(kCounts)); ++n) {
    const std::uint32_t count = kCounts[n % std::size(kCounts)];
    const PlacedField field(map, random_pose(random, 0.02));
    const Places places = random_places(random, count);
    Values values;
    field.penetrations(places, values);
    for (std::uint32_t i = 0; i < count; ++i) {
      const float v = field.penetration(places[i]);
      // Beyond the band a value is only no farther from 0.
      if (std::abs(v) > map.voxel_size) continue;
      ASSERT_NEAR(values[i], v, 1e-4 * map.voxel_size) << count;
      ++in_band;
    }
  }
  EXPECT_GT(in_band, 100);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/vps_runtime.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

using Profile = RevolvedField::Profile;

TEST(AnalyticFields, AreSignedDistancesPositiveInside) {
  const BoxField box{{1, 2, 3}};
  EXPECT_FLOAT_EQ(penetration(box, {0, 0, 0}), 1);
  EXPECT_FLOAT_EQ(penetration(box, {0.75F, 0, 0}), 0.25F);
  EXPECT_FLOAT_EQ(penetration(box, {1, 0, 0}), 0);
  EXPECT_FLOAT_EQ(penetration(box, {4, 6, 0}), -5);
  EXPECT_FLOAT_EQ(penetration(SphereField{2}, {0, 0, 1}), 1);
  EXPECT_FLOAT_EQ(penetration(SphereField{2}, {0, 5, 0}), -3);
  EXPECT_FLOAT_EQ(penetration(HalfSpaceField{{0, 1, 0}, 1}, {9, 0.25F, 9}), 0.75F);
  EXPECT_FLOAT_EQ(penetration(HalfSpaceField{{0, 1, 0}, 1}, {9, 3, 9}), -2);
  EXPECT_FLOAT_EQ(penetration(RevolvedField{Profile::capsule, 1, 2, 0.5F}, {0, 0, 3}), 0.5F);
  EXPECT_FLOAT_EQ(penetration(RevolvedField{Profile::cylinder, 1, 2, 0}, {0, 0.5F, 1.75F}), 0.25F);
  EXPECT_FLOAT_EQ(penetration(RevolvedField{Profile::cylinder, 1, 2, 0}, {0, 4, -6}), -5);
  EXPECT_FLOAT_EQ(penetration(RevolvedField{Profile::cone, 3, 2, 0}, {0, 0, 3}), -1);
  EXPECT_FLOAT_EQ(penetration(RevolvedField{Profile::cone, 3, 2, 0}, {0, 0, -2}), 0);
}

struct Place {
  double r, z;
};

// Points on the profile's border in the half plane r >= 0, at most about 0.001 apart.
std::vector<Place> border(const RevolvedField& solid) {
  std::vector<Place> out;
  const double radius = double{solid.radius};
  const double half = double{solid.half_height};
  const auto line = [&](Place from, Place to) {
    const int steps = static_cast<int>(1000 * std::hypot(to.r - from.r, to.z - from.z));
    for (int i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps;
      out.push_back({from.r + t * (to.r - from.r), from.z + t * (to.z - from.z)});
    }
  };
  switch (solid.profile) {
    case Profile::capsule:
      line({radius, -half}, {radius, half});
      for (int i = 0; i <= 2000; ++i) {
        const double angle = i * std::acos(0.0) / 2000;
        out.push_back({radius * std::cos(angle), half + radius * std::sin(angle)});
        out.push_back({radius * std::cos(angle), -half - radius * std::sin(angle)});
      }
      break;
    case Profile::cylinder:
      line({0, half}, {radius, half});
      line({radius, half}, {radius, -half});
      line({radius, -half}, {0, -half});
      break;
    case Profile::cone:
      line({0, half}, {radius, -half});
      line({radius, -half}, {0, -half});
      break;
  }
  return out;
}

bool is_inside(const RevolvedField& solid, double r, double z) {
  const double radius = double{solid.radius};
  const double half = double{solid.half_height};
  switch (solid.profile) {
    case Profile::capsule:
      return std::hypot(r, std::max(std::abs(z) - half, 0.0)) <= radius;
    case Profile::cylinder:
      return r <= radius && std::abs(z) <= half;
    case Profile::cone:
      return z >= -half && r <= radius * (half - z) / (2 * half);
  }
  return false;
}

class Revolved : public testing::TestWithParam<RevolvedField> {};

TEST_P(Revolved, IsTheDistanceToTheNearestPlaceOfItsBorder) {
  const RevolvedField solid = GetParam();
  const std::vector<Place> places = border(solid);
  Random random;
  for (int n = 0; n < 300; ++n) {
    const Vec3 p{static_cast<float>(random.between(-2, 2)), static_cast<float>(random.between(-2, 2)),
                 static_cast<float>(random.between(-2, 2))};
    const double r = std::hypot(double{p.x}, double{p.y});
    const double z = double{p.z};
    double nearest = 1e30;
    for (const Place& place : places) nearest = std::min(nearest, std::hypot(r - place.r, z - place.z));
    const double expected = (is_inside(solid, r, z) ? nearest : -nearest) + double{solid.rounding};
    ASSERT_NEAR(penetration(solid, p), expected, 1e-3) << n;
    const Vec3 out = outward_normal(solid, p);
    ASSERT_NEAR(std::hypot(out.x, out.y, out.z), 1, 1e-5);
    constexpr float kStep = 1e-3F;
    ASSERT_NEAR(penetration(solid, {p.x + kStep * out.x, p.y + kStep * out.y, p.z + kStep * out.z}),
                penetration(solid, p) - kStep, 1e-5)
        << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Profiles, Revolved,
                         testing::Values(RevolvedField{Profile::capsule, 0.5F, 0.75F, 0},
                                         RevolvedField{Profile::cylinder, 0.75F, 0.5F, 0},
                                         RevolvedField{Profile::cylinder, 0.5F, 1.25F, 0.1F},
                                         RevolvedField{Profile::cone, 0.75F, 0.5F, 0},
                                         RevolvedField{Profile::cone, 0.25F, 1, 0.04F}));

TEST(Polytope, IsExactInsideAndNeverTooFarOutside) {
  const BoxField box{{0.5F, 1, 1.5F}};
  const std::vector<HalfSpaceField> planes = {{{1, 0, 0}, 0.5F}, {{-1, 0, 0}, 0.5F}, {{0, 1, 0}, 1},
                                              {{0, -1, 0}, 1},   {{0, 0, 1}, 1.5F},  {{0, 0, -1}, 1.5F}};
  const PolytopeField solid{planes};
  Random random;
  int inside = 0;
  for (int n = 0; n < 1000; ++n) {
    const Vec3 p{static_cast<float>(random.between(-2, 2)), static_cast<float>(random.between(-2, 2)),
                 static_cast<float>(random.between(-2, 2))};
    const float exact = penetration(box, p);
    if (exact >= 0) {
      ++inside;
      ASSERT_FLOAT_EQ(penetration(solid, p), exact);
      const Vec3 out = outward_normal(solid, p);
      ASSERT_NEAR(penetration(solid, {p.x + exact * out.x, p.y + exact * out.y, p.z + exact * out.z}), 0, 1e-6);
    } else {
      ASSERT_GE(penetration(solid, p), exact);
      ASSERT_LT(penetration(solid, p), 0);
    }
  }
  EXPECT_GT(inside, 30);
  EXPECT_EQ(penetration(PolytopeField{}, {0, 0, 0}), std::numeric_limits<float>::infinity());
}

}  // namespace
}  // namespace vps::test

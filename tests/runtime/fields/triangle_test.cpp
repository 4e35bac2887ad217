// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles compared with places side by side, on every instruction set of the machine.
#include "runtime/fields/triangle.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <array>
#include <numeric>

#include "tests/support/random.h"

namespace vps::test {
namespace {

using namespace detail;

// A sheet of triangles that bends, and some beside it.
std::vector<Triangle> triangles(Random& random) {
  std::vector<Triangle> all;
  const auto add = [&](const double(&corners)[3][3]) {
    Triangle triangle;
    if (triangle.set(corners)) all.push_back(triangle);
  };
  constexpr int kCells = 4;
  double height[kCells + 1][kCells + 1];
  for (auto& row : height) {
    for (double& z : row) z = random.between(-0.1, 0.1);
  }
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const auto corner = [&](int a, int b) { return std::array{0.5 * a - 1, 0.5 * b - 1, height[a][b]}; };
      const std::array a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1), d = corner(i, j + 1);
      add({{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}});
      add({{a[0], a[1], a[2]}, {c[0], c[1], c[2]}, {d[0], d[1], d[2]}});
    }
  }
  return all;
}

class OnEveryTarget : public testing::TestWithParam<std::int64_t> {
 protected:
  void SetUp() override { hwy::SetSupportedTargetsForTest(GetParam()); }
  void TearDown() override { hwy::SetSupportedTargetsForTest(0); }
};

TEST_P(OnEveryTarget, PlacesSideBySideAreAsOneByOne) {
  Random random(3);
  std::size_t over = 0, same = 0, beside = 0, out_of_reach = 0, within = 0, compared = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const std::vector<Triangle> all = triangles(random);
    std::vector<std::uint32_t> list(all.size() - std::size_t(trial % 7));
    std::iota(list.begin(), list.end(), std::uint32_t(trial % 7));
    Spheres spheres;
    std::array<Vec3, Spheres::kMost> at;
    for (std::uint32_t k = 0; k < Spheres::kMost; ++k) {
      const auto coordinate = [&] { return static_cast<float>(random.between(-1.1, 1.1)); };
      at[k] = {coordinate(), coordinate(), 0.3F * coordinate()};
      spheres.set(k, at[k], static_cast<float>(random.between(0, 0.6)));
    }
    std::vector<std::uint16_t> masks(list.size(), 0xFFFF);
    float least[Spheres::kMost];
    find_within(all.data(), list, spheres, masks, least);
    constexpr float kReach = 0.2F;
    NearestFaces nearest;
    find_nearest_faces(all.data(), list, spheres, kReach, nearest);
    for (std::uint32_t k = 0; k < Spheres::kMost; ++k) {
      float wanted = std::numeric_limits<float>::max();
      for (std::size_t i = 0; i < list.size(); ++i) {
        const bool is_within = all[list[i]].is_within(at[k], spheres.reach[k]);
        ASSERT_EQ((masks[i] >> k & 1) != 0, is_within) << trial;
        wanted = std::min(wanted, all[list[i]].least_squared(at[k]));
        within += is_within;
        ++compared;
      }
      ASSERT_EQ(least[k], wanted) << trial;
      NearestPlace place;
      place.squared = kReach * kReach;
      const auto listed = [&](std::uint32_t number) -> const Triangle& { return all[number]; };
      const Triangle* const found = nearest_triangle(list, listed, at[k], place);
      if (nearest.number[k] == NearestFaces::kNone) {
        ASSERT_EQ(found, nullptr) << trial;
        ++out_of_reach;
      } else if (nearest.beyond[k] == 0) {
        // At an edge two triangles may be as near, but for rounding.
        ASSERT_NE(found, nullptr) << trial;
        ASSERT_NEAR(place.squared, nearest.squared[k], 1e-5F * place.squared) << trial;
        same += found == &all[nearest.number[k]];
        ++over;
      } else {
        ASSERT_LE(nearest.squared[k], place.squared * (1 + 1e-5F)) << trial;
        ++beside;
      }
    }
  }
  EXPECT_GT(same, over - over / 100);
  EXPECT_GT(std::min({over, beside, out_of_reach}), 100U);
  EXPECT_GT(within, compared / 20);
  EXPECT_LT(within, compared / 2);
}

std::vector<std::int64_t> targets() {
  std::vector<std::int64_t> each;
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    each.push_back(left & -left);
  }
  return each;
}
INSTANTIATE_TEST_SUITE_P(Triangles, OnEveryTarget, testing::ValuesIn(targets()),
                         [](const auto& one) { return std::string(hwy::TargetName(one.param)); });

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/octant_trial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/sample_brick.h"
#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr int kEdge = FieldBrick::kEdge;
constexpr FieldTolerance kAnyError{100, 6, 6};

// A ball's surface in a brick, and an interpolation that errs a little. Distances are wrong by up to their bound.
struct BallTrial {
  OctantTrial trial;
  std::array<double, 125> truth;
  double worst = 0;  // exact error of the interpolation

  BallTrial(Random& random, float error) {
    const Vector middle(2 * random.next() - 1, 2 * random.next() - 1, 3 * random.next());
    const double radius = 1 + random.next();
    trial.step = random.next() < 0.5 ? 0.5F : 0.25F;
    trial.reach = 6;
    trial.error = error;
    trial.distance.fill(0);
    const auto at = [&](int x, int y, int z) {
      return radius - (static_cast<double>(trial.step) * Vector(x, y, z) - middle).norm();
    };
    for (int n = 0; n < 27; ++n) {
      const double v = at(2 * (n % 3), 2 * (n / 3 % 3), 2 * (n / 9));
      trial.value[static_cast<std::size_t>(n)] = static_cast<float>(v);
      trial.fitted[static_cast<std::size_t>(n)] = static_cast<float>(v + 0.1 * (random.next() - 0.5));
    }
    for (int n = 0; n < 125; ++n) {
      const int i[3] = {n % kEdge, n / kEdge % kEdge, n / (kEdge * kEdge)};
      const auto sample = static_cast<std::size_t>(n);
      truth[sample] = at(i[0], i[1], i[2]);
      double sum = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const int c[3] = {(i[0] + (corner & 1)) / 2, (i[1] + (corner >> 1 & 1)) / 2, (i[2] + (corner >> 2)) / 2};
        sum += static_cast<double>(trial.fitted[static_cast<std::size_t>((c[2] * 3 + c[1]) * 3 + c[0])]);
      }
      // The distance that makes the error look smallest.
      const double shown = std::clamp(sum / 8, truth[sample] - error, truth[sample] + error);
      trial.distance[sample] = static_cast<float>(std::abs(shown));
      if (i[0] % 2 + i[1] % 2 + i[2] % 2 > 0) worst = std::max(worst, std::abs(sum / 8 - truth[sample]));
    }
  }
  [[nodiscard]] bool accepts(const FieldTolerance& tolerance, double noted) const {
    return surely_interpolates(trial, tolerance, noted, [&](std::size_t n) { return truth[n] > 0; });
  }
};

TEST(OctantTrial, WhatExactDistancesRejectIsRejected) {
  Random random(1);
  for (int n = 0; n < 20000; ++n) {
    const BallTrial ball(random, n % 2 == 0 ? 0.0F : 1e-4F);
    ASSERT_FALSE(ball.accepts({ball.worst * (1 - 1e-9), 6, 6}, 100));
    ASSERT_FALSE(ball.accepts(kAnyError, ball.worst * (1 - 1e-9)));
  }
}

TEST(OctantTrial, WhatIsGoodEnoughByMoreThanRoundingIsAccepted) {
  Random random(2);
  for (int n = 0; n < 20000; ++n) {
    const BallTrial ball(random, 1e-4F);
    ASSERT_TRUE(ball.accepts({ball.worst + 2.5e-4, 6, 6}, 100));
    ASSERT_TRUE(ball.accepts(kAnyError, ball.worst + 2.5e-4));
  }
}

TEST(OctantTrial, BeyondTheBandAnyErrorWillDo) {
  Random random(3);
  BallTrial ball(random, 1e-4F);
  ball.trial.value.fill(-5);
  ball.trial.distance.fill(5);
  EXPECT_FALSE(ball.accepts({0.001, 6, 6}, 100));
  EXPECT_TRUE(ball.accepts({0.001, 4, 4}, 100));
  EXPECT_TRUE(ball.accepts({0.001, 6, 4}, 100)) << "the inner band does not matter outside";
  EXPECT_FALSE(ball.accepts({0.001, 4, 6}, 100));
}

TEST(OctantTrial, TrianglesNearAnOctantIncludeTheClosestOfEachOfItsPoints) {
  const Scene scene(make_torus(0.1, 0.04, 120, 60), 0.004, 3.5);
  const InsideTest inside(scene.surface, scene.grid);
  const FieldTolerance tolerance{0.1 * 0.004, 2.5 * 0.004, 2.5 * 0.004};
  BrickSampler sampler({scene.surface, scene.grid, scene.runs, scene.field, inside, tolerance});
  Random random(4);
  int tested = 0;
  std::size_t all = 0;
  std::size_t kept = 0;
  const auto expect_closest = [&](const FieldBrick& brick, std::span<const std::uint32_t> from,
                                  std::span<const std::uint32_t> listed) {
    const double edge = FieldBrick::step_of(brick.level) * FieldBrick::kCells;
    const Vector low =
        scene.grid.centre(0, 0, 0) + sampler.quarter() * Vector(brick.base[0], brick.base[1], brick.base[2]);
    const Vector p = low + sampler.quarter() * edge * Vector(random.next(), random.next(), random.next());
    const auto least = [&](const auto& triangle_of, std::size_t count) {
      double squared = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < count; ++i) {
        const std::uint32_t t = triangle_of(i);
        squared = std::min(squared, (closest_on_triangle(p, scene.surface.corner(t, 0), scene.surface.corner(t, 1),
                                                         scene.surface.corner(t, 2)) -
                                     p)
                                        .squaredNorm());
      }
      return squared;
    };
    ASSERT_EQ(least([&](std::size_t i) { return listed[from[i]]; }, from.size()),
              least([&](std::size_t i) { return listed[i]; }, listed.size()));
    ++tested;
  };
  for (std::size_t n = 0; n < scene.field.set.bricks.size(); ++n) {
    const Index3& at = scene.field.set.bricks[n];
    if (!sampler.load({at[0], at[1], at[2]})) continue;
    const std::span<const std::uint32_t> listed(scene.field.near_triangles.data() + scene.field.near_start[n],
                                                scene.field.near_triangles.data() + scene.field.near_start[n + 1]);
    FieldBrick whole;
    sampler.load_octant(whole);
    for (int octant = 0; octant < 8; ++octant) {
      FieldBrick brick;
      sampler.load_voxels(0, whole.octant_base(octant), brick);
      const NearList from = sampler.near(brick);
      expect_closest(brick, from.closest(), listed);
      const NearTriangles near = sampler.near_octants(brick, from.all);
      for (int part = 0; part < 8; ++part) {
        const std::span<const std::uint32_t> closest = near.in_octant(part).closest();
        FieldBrick between;
        sampler.load_between(brick, part, closest, between);
        expect_closest(between, closest, listed);
        all += listed.size();
        kept += closest.size();
      }
    }
  }
  EXPECT_GT(tested, 1000);
  EXPECT_LT(kept, all / 2);
}

}  // namespace
}  // namespace vps::test

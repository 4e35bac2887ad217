// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/float_distances.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cmath>

#include "tests/support/random.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr double kReach = 4.5;

Vector random_vector(Random& random, double size) {
  return size * Vector(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5);
}

// Triangles of all sizes and shapes, near places that are within reach of the centre.
struct Case {
  Mesh mesh;
  Vector centre = Vector::Zero();
  double unit = 0.001;
  Places128 places;

  explicit Case(Random& random) {
    centre = random_vector(random, 10 * unit);
    const Vector middle = centre + random_vector(random, 8 * unit);
    const double size = unit * std::pow(10, 5 * random.next() - 2);
    // From a hundredth to all of the other edges' length.
    const double third = std::pow(10, -2 * random.next());
    mesh.vertices = {middle + random_vector(random, size), middle + random_vector(random, size), Vector::Zero()};
    mesh.vertices[2] =
        mesh.vertices[0] + random.next() * (mesh.vertices[1] - mesh.vertices[0]) + random_vector(random, third * size);
    mesh.triangles = {{0, 1, 2}};
    for (std::size_t n = 0; n < 128; ++n) {
      const Vector p = random_vector(random, 2 * kReach);
      places.x[n] = static_cast<float>(p.x());
      places.y[n] = static_cast<float>(p.y());
      places.z[n] = static_cast<float>(p.z());
    }
  }
  [[nodiscard]] double exact(std::size_t n) const {
    const Vector p = centre + unit * Vector(places.x[n], places.y[n], places.z[n]);
    return (closest_on_triangle(p, mesh.corner(0, 0), mesh.corner(0, 1), mesh.corner(0, 2)) - p).norm() / unit;
  }
};

// Largest error of many distances, divided by its bound.
double worst_share() {
  Random random(1);
  double worst = 0;
  for (int n = 0; n < 4000; ++n) {
    const Case c(random);
    const FloatTriangle triangle = float_triangle(c.mesh, 0, c.centre, c.unit, kReach);
    const std::uint32_t chosen[] = {0};
    std::array<float, 128> distances;
    nearest_distances({&triangle, 1}, chosen, c.places, distances);
    for (std::size_t i = 0; i < distances.size(); ++i) {
      worst = std::max(worst, std::abs(distances[i] - c.exact(i)) / triangle.error);
    }
  }
  return worst;
}

TEST(FloatDistances, ErrorsAreWithinTheirBound) {
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    hwy::DisableTargets(~(targets & -targets));
    const double worst = worst_share();
    hwy::DisableTargets(0);
    EXPECT_LE(worst, 1) << hwy::TargetName(targets & -targets);
    // A bound that is far from reached would be a waste.
    EXPECT_GT(worst, 0.1) << hwy::TargetName(targets & -targets);
  }
}

TEST(FloatDistances, ASliverCountsAsItsLongestEdge) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {0.5, 5e-5, 0}, {1, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  const FloatTriangle sliver = float_triangle(mesh, 0, {0, 0, 0}, 1, kReach);
  EXPECT_NEAR(sliver.error, 5e-5, 2e-5);
  Places128 places;
  Random random(3);
  for (std::size_t n = 0; n < 128; ++n) {
    places.x[n] = static_cast<float>(2 * random.next() - 0.5);
    places.y[n] = static_cast<float>(2e-4 * (random.next() - 0.5));
    places.z[n] = static_cast<float>(n % 2 == 0 ? 0 : random.next());
  }
  const std::uint32_t chosen[] = {0};
  std::array<float, 128> distances;
  nearest_distances({&sliver, 1}, chosen, places, distances);
  for (std::size_t n = 0; n < 128; ++n) {
    const Vector p(places.x[n], places.y[n], places.z[n]);
    const double exact = (closest_on_triangle(p, mesh.corner(0, 0), mesh.corner(0, 1), mesh.corner(0, 2)) - p).norm();
    EXPECT_NEAR(distances[n], exact, sliver.error);
  }
  mesh.vertices[1].y() = 5e-4;
  EXPECT_LT(float_triangle(mesh, 0, {0, 0, 0}, 1, kReach).error, 2e-5);
}

TEST(FloatDistances, BothWaysGiveTheSame) {
  Random random(2);
  const Case c(random);
  const FloatTriangle triangle = float_triangle(c.mesh, 0, c.centre, c.unit, kReach);
  Places16 places;
  std::copy_n(c.places.x.begin(), 16, places.x.begin());
  std::copy_n(c.places.y.begin(), 16, places.y.begin());
  std::copy_n(c.places.z.begin(), 16, places.z.begin());
  const std::uint32_t chosen[] = {0};
  std::array<float, 16> one[1];
  triangle_distances({&triangle, 1}, chosen, places, one);
  std::array<float, 128> nearest;
  nearest_distances({&triangle, 1}, chosen, c.places, nearest);
  for (std::size_t n = 0; n < 16; ++n) EXPECT_EQ(one[0][n], nearest[n]);
}

TEST(FloatDistances, ATriangleIsMarkedWhereverItIsNearest) {
  Random random(4);
  std::size_t nearest = 0;
  std::size_t marked = 0;
  for (int round = 0; round < 200; ++round) {
    const Case first(random);
    std::vector<Case> cases;
    std::vector<FloatTriangle> triangles;
    std::vector<std::uint32_t> chosen;
    for (std::uint32_t n = 0; n < 24; ++n) {
      cases.emplace_back(random);
      cases[n].centre = first.centre;
      cases[n].places = first.places;
      triangles.push_back(float_triangle(cases[n].mesh, 0, first.centre, first.unit, kReach));
      chosen.push_back(n);
    }
    std::vector<PlaceBits> bits(chosen.size());
    find_where_nearest(triangles, chosen, first.places, 0, bits);
    for (std::size_t place = 0; place < 128; ++place) {
      std::size_t best = 0;
      for (std::size_t n = 0; n < cases.size(); ++n) {
        if (cases[n].exact(place) < cases[best].exact(place)) best = n;
        marked += bits[n][place / 8] >> place % 8 & 1;
      }
      nearest += bits[best][place / 8] >> place % 8 & 1;
    }
  }
  EXPECT_EQ(nearest, std::size_t{200 * 128});
  EXPECT_LT(marked, nearest + nearest / 50);
}

}  // namespace
}  // namespace vps::test

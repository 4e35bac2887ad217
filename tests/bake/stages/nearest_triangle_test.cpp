// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/nearest_triangle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tests/support/random.h"

namespace vps::test {

using namespace bake;
namespace {

Vector vector_within(Random& random, double size) {
  return size * Vector(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5);
}

void add_triangle(Surface& surface, const Vector& a, const Vector& b, const Vector& c) {
  const auto first = static_cast<std::uint32_t>(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), {a, b, c});
  surface.triangles.push_back({first, first + 1, first + 2});
  surface.normals.push_back(surface.area_normal(surface.triangles.size() - 1).stableNormalized());
}

// The same arithmetic for one triangle and point after the other, without a search.
void offer_slowly(const Surface& surface, std::uint32_t t, const PointLattice& points, double band,
                  NearestTriangles& nearest) {
  const double s = points.step;
  const Vector& n = surface.normals[t];
  const auto dot = [](const Vector& a, const Vector& b) { return a.x() * b.x() + (a.y() * b.y() + a.z() * b.z()); };
  const auto rows = [&](int axis, double sign) {
    const double values[3] = {surface.corner(t, 0)[axis], surface.corner(t, 1)[axis], surface.corner(t, 2)[axis]};
    const double end = sign < 0 ? *std::min_element(values, values + 3) : *std::max_element(values, values + 3);
    return (end - points.first[axis] + sign * band) / s;
  };
  for (int number = 0; number < static_cast<int>(kBrickVoxels); ++number) {
    const Vector p(number % 8 * s, number / 8 % 8 * s, number / 64 * s);
    const Vector from_first = p - (surface.corner(t, 0) - points.first);
    const double height_y = from_first.y() * n.y();
    const double height_z = from_first.z() * n.z();
    const double middle = (3.5 * s - (surface.corner(t, 0) - points.first).x()) * n.x() + height_y + height_z;
    if (std::abs(middle) > (band + std::abs(n.x()) * 3.5 * s) * (1 + 1e-9)) continue;
    if (number / 8 % 8 < std::ceil(rows(1, -1)) || number / 8 % 8 > std::floor(rows(1, 1))) continue;
    if (number / 64 < std::ceil(rows(2, -1)) || number / 64 > std::floor(rows(2, 1))) continue;
    double squared = std::numeric_limits<double>::infinity();
    bool over = true;
    for (int k = 0; k < 3; ++k) {
      const Vector edge = surface.corner(t, (k + 1) % 3) - surface.corner(t, k);
      const Vector d = p - (surface.corner(t, k) - points.first);
      const double at = std::clamp(dot(d, edge) * (1 / edge.squaredNorm()), 0.0, 1.0);
      const Vector e = d - at * edge;
      squared = std::min(squared, e.x() * e.x() + e.y() * e.y() + e.z() * e.z());
      over = over && dot(d, edge.cross(n)) < 0;
    }
    const double height = from_first.x() * n.x() + (height_y + height_z);
    if (over) squared = height * height;
    const auto at = static_cast<std::size_t>(number);
    if (squared >= nearest.squared[at]) continue;
    nearest.squared[at] = squared;
    nearest.triangle[at] = static_cast<double>(t);
  }
}

void expect_as_slow(const Surface& surface, const PointLattice& points, double band) {
  NearestTriangles fast;
  fast.squared.fill(band * band * (1 + 1e-9));
  fast.triangle.fill(-1);
  NearestTriangles slow = fast;
  std::vector<std::uint32_t> all(surface.triangles.size());
  std::iota(all.begin(), all.end(), 0U);
  offer_triangles(surface, all, points, band, fast);
  for (const std::uint32_t t : all) offer_slowly(surface, t, points, band, slow);
  for (int number = 0; number < static_cast<int>(kBrickVoxels); ++number) {
    if (std::max({number % 8, number / 8 % 8, number / 64}) >= points.edge) continue;
    const auto at = static_cast<std::size_t>(number);
    ASSERT_EQ(fast.triangle[at], slow.triangle[at]) << number;
    ASSERT_EQ(fast.squared[at], slow.squared[at]) << number;
  }
}

}  // namespace

TEST(NearestTriangle, SearchFindsWhatEveryTriangleInTurnGives) {
  Random random(1);
  for (int n = 0; n < 300; ++n) {
    Surface surface;
    const double step = 0.001 * (0.5 + random.next());
    const PointLattice points{vector_within(random, 0.02), step, random.next() < 0.3 ? 5 : 8};
    const Vector middle = points.at(4, 4, 4);
    const int count = 1 + static_cast<int>(80 * random.next());
    for (int t = 0; t < count; ++t) {
      // From small against a step to large against the lattice, slivers included.
      const double size = step * std::pow(10, 4 * random.next() - 2);
      const Vector a = middle + vector_within(random, 14 * step);
      const Vector b = a + vector_within(random, size);
      const Vector c = a + random.next() * (b - a) + vector_within(random, size * std::pow(10, -7 * random.next()));
      add_triangle(surface, a, b, c);
    }
    expect_as_slow(surface, points, step * (1 + 4 * random.next()));
  }
}

TEST(NearestTriangle, PointsExactlyAtTheEndOfTheBandAreFoundAlike) {
  // Squares on the lattice's planes: many distances are equal, many are whole steps.
  for (int axis = 0; axis < 3; ++axis) {
    for (int place = -4; place <= 11; ++place) {
      Surface surface;
      constexpr double kStep = 0.1;
      const PointLattice points{Vector(0.3, -0.7, 1.1), kStep};
      for (int u = -8; u < 16; u += 2) {
        const auto at = [&](int i, int j) {
          Vector p = points.first;
          p[axis] += kStep * place;
          p[(axis + 1) % 3] += kStep * i;
          p[(axis + 2) % 3] += kStep * j;
          return p;
        };
        add_triangle(surface, at(u, -8), at(u + 2, -8), at(u + 2, 16));
        add_triangle(surface, at(u, -8), at(u + 2, 16), at(u, 16));
      }
      for (const double band : {1.0, 3.0, 3.5, 4.0}) expect_as_slow(surface, points, band * kStep);
    }
  }
}

}  // namespace vps::test

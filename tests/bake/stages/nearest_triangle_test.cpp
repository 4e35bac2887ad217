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
// @param side  points along an axis
template <std::size_t kCount>
void offer_slowly(const Surface& surface, std::uint32_t t, const PointLattice& points, double band, int side,
                  NearestOf<kCount>& nearest) {
  const double s = points.step;
  const Vector& n = surface.normals[t];
  const auto dot = [](const Vector& a, const Vector& b) { return a.x() * b.x() + (a.y() * b.y() + a.z() * b.z()); };
  const auto rows = [&](int axis, double sign) {
    const double values[3] = {surface.corner(t, 0)[axis], surface.corner(t, 1)[axis], surface.corner(t, 2)[axis]};
    const double end = sign < 0 ? *std::min_element(values, values + 3) : *std::max_element(values, values + 3);
    return (end - points.first[axis] + sign * band) / s;
  };
  for (int number = 0; number < side * side * side; ++number) {
    const int y = number / side % side;
    const int z = number / (side * side);
    const Vector p(number % side * s, y * s, z * s);
    const Vector from_first = p - (surface.corner(t, 0) - points.first);
    const double height_y = from_first.y() * n.y();
    const double height_z = from_first.z() * n.z();
    const double middle = (3.5 * s - (surface.corner(t, 0) - points.first).x()) * n.x() + height_y + height_z;
    if (std::abs(middle) > (band + std::abs(n.x()) * 3.5 * s) * (1 + 1e-9)) continue;
    if (y < std::ceil(rows(1, -1)) || y > std::floor(rows(1, 1))) continue;
    if (z < std::ceil(rows(2, -1)) || z > std::floor(rows(2, 1))) continue;
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
  for (const std::uint32_t t : all) offer_slowly(surface, t, points, band, 8, slow);
  for (std::size_t at = 0; at < kBrickVoxels; ++at) {
    ASSERT_EQ(fast.triangle[at], slow.triangle[at]) << at;
    ASSERT_EQ(fast.squared[at], slow.squared[at]) << at;
  }
}

}  // namespace

TEST(NearestTriangle, SearchFindsWhatEveryTriangleInTurnGives) {
  Random random(1);
  for (int n = 0; n < 300; ++n) {
    Surface surface;
    const double step = 0.001 * (0.5 + random.next());
    const PointLattice points{vector_within(random, 0.02), step};
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

TEST(NearestTriangle, SamplesGetWhatEveryTriangleInTurnGives) {
  Random random(2);
  for (int n = 0; n < 300; ++n) {
    Surface surface;
    const double step = 0.001 * (0.5 + random.next());
    const PointLattice points{vector_within(random, 0.02), step};
    const Vector middle = points.at(2, 2, 2);
    // Rings of triangles with a common corner, so that many distances are equal. No slivers, for whose distances nearer
    // ones may stand in one of the two ways only.
    for (int ring = 0; ring < 6; ++ring) {
      const Vector top = middle + vector_within(random, 8 * step);
      const double size = step * std::pow(10, 2 * random.next() - 1);
      const Vector u = size * Vector(random.next(), 1, random.next() - 0.5);
      const Vector v = size * Vector(1, random.next() - 0.5, random.next());
      const Vector corners[4] = {top + u, top + v, top - u, top - v};
      for (int k = 0; k < 4; ++k) add_triangle(surface, top, corners[k], corners[(k + 1) % 4]);
    }
    std::vector<std::uint32_t> all(surface.triangles.size());
    std::iota(all.begin(), all.end(), 0U);
    std::vector<FloatTriangle> triangles;
    for (const std::uint32_t t : all) triangles.push_back(float_triangle(surface, t, middle, step, 2));
    Places128 places;
    for (std::size_t i = 0; i < 125; ++i) {
      places.x[i] = static_cast<float>(i % 5) - 2;
      places.y[i] = static_cast<float>(i / 5 % 5) - 2;
      places.z[i] = static_cast<float>(i / 25) - 2;
    }
    std::vector<PlaceBits> bits(all.size());
    find_where_nearest(triangles, all, places, static_cast<float>(kEquallyNear), bits);
    const double band = step * (1 + 4 * random.next());
    NearestToSamples fast;
    fast.squared.fill(band * band);
    fast.triangle.fill(-1);
    NearestToSamples slow = fast;
    offer_triangles(surface, all, bits, points, band, fast);
    for (const std::uint32_t t : all) offer_slowly(surface, t, points, band, 5, slow);
    for (std::size_t at = 0; at < 125; ++at) {
      ASSERT_EQ(fast.triangle[at], slow.triangle[at]) << at;
      ASSERT_EQ(fast.squared[at], slow.squared[at]) << at;
    }
  }
}

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vps::test {
namespace {

using Polygon = std::vector<std::array<double, 3>>;

double signed_area(const Polygon& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return ((p[b][0] - p[a][0]) * (p[c][1] - p[a][1]) - (p[b][1] - p[a][1]) * (p[c][0] - p[a][0])) / 2;
}

// Every triangle is wound like the polygon, so that equal areas exclude overlaps and gaps.
void expect_partition(const Polygon& polygon) {
  double area = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    area += signed_area(polygon, 0, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(i + 1));
  }
  const auto triangles = triangulate_polygon(polygon);
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  double sum = 0;
  for (const auto& [a, b, c] : triangles) {
    const double piece = signed_area(polygon, a, b, c);
    EXPECT_GE(piece * area, 0);
    sum += piece;
  }
  EXPECT_NEAR(sum, area, 1e-12 * std::abs(area));
}

TEST(Triangulate, ASquareAndAConcaveArrowAreCutWithoutOverlap) {
  expect_partition({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  expect_partition({{0, 0, 0}, {2, -1, 0}, {0.5, 0, 0}, {2, 1, 0}});
}

TEST(Triangulate, AStarOfManyPointsInEitherWindingIsCutWithoutOverlap) {
  for (const int turn : {1, -1}) {
    Polygon star;
    for (int i = 0; i < 66; ++i) {
      const double r = i % 2 == 0 ? 1 : 0.3;
      star.push_back({r * std::cos(turn * i * M_PI / 33), r * std::sin(turn * i * M_PI / 33), 0});
    }
    expect_partition(star);
  }
}

TEST(Triangulate, CollinearCornersAreKeptAndRepeatedOnesDropped) {
  expect_partition({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {2, 2, 0}, {0, 2, 0}, {0, 1, 0}});
  const Polygon repeated = {{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate_polygon(repeated).size(), 2U);
}

TEST(Triangulate, DegeneratePolygonsEnd) {
  EXPECT_EQ(triangulate_polygon(Polygon(7, {1, 2, 3})).size(), 0U);
  EXPECT_EQ(triangulate_polygon(Polygon{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}).size(), 2U);
  EXPECT_EQ(triangulate_polygon(Polygon{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).size(), 2U);  // a bow tie
}

TEST(Triangulate, TheFacingOfThePolygonInSpaceDoesNotMatter) {
  const Polygon arrow = {{0, 0, 0}, {2, -1, 0}, {0.5, 0, 0}, {2, 1, 0}};
  const auto flat = triangulate_polygon(arrow);
  Polygon upright = arrow;
  for (auto& p : upright) p = {p[2], p[0], p[1]};
  EXPECT_EQ(triangulate_polygon(upright), flat);
}

}  // namespace
}  // namespace vps::test

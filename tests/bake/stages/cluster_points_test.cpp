// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/cluster_points.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

std::vector<Vector> points_on_sphere(std::size_t count, double radius) {
  // Fibonacci lattice: nearly uniform.
  std::vector<Vector> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(count);
    const double angle = static_cast<double>(i) * 2.399963229728653;
    const double r = std::sqrt(1 - z * z);
    points.emplace_back(radius * Vector(r * std::cos(angle), r * std::sin(angle), z));
  }
  return points;
}

// Checks the structure of the tree, for any points.
void expect_tree(const PointTree& tree, std::size_t points) {
  const std::size_t levels = tree.level_offsets.size() - 1;
  const std::size_t nodes = tree.first.size();
  ASSERT_EQ(tree.level_offsets.front(), 0U);
  ASSERT_EQ(tree.level_offsets[1], 1U);
  ASSERT_EQ(tree.level_offsets.back(), nodes);
  ASSERT_EQ(tree.count.size(), nodes);
  ASSERT_EQ(tree.parent_point.size(), nodes);
  for (std::size_t level = 0; level < levels; ++level) {
    const bool leaf = level + 1 == levels;
    std::uint32_t next = leaf ? 0 : tree.level_offsets[level + 1];
    for (std::uint32_t n = tree.level_offsets[level]; n < tree.level_offsets[level + 1]; ++n) {
      ASSERT_EQ(tree.first[n], next);
      ASSERT_GE(tree.count[n], 1U);
      next += tree.count[n];
    }
    ASSERT_EQ(next, leaf ? points : tree.level_offsets[level + 2]);
  }
  const std::set<std::uint32_t> all(tree.order.begin(), tree.order.end());
  ASSERT_EQ(all.size(), points);
  ASSERT_EQ(*all.rbegin(), points - 1);
}

TEST(ClusterPoints, EveryPointHasOneLeafAndEveryNodeOneParent) {
  for (const std::size_t count : {1U, 2U, 7U, 8U, 9U, 100U, 5000U}) {
    for (const std::uint32_t k : {2U, 4U, 8U, 16U}) {
      const auto points = points_on_sphere(count, 0.1);
      expect_tree(cluster_points(points, {}, 4 * M_PI * 0.01, k), count);
    }
  }
}

TEST(ClusterPoints, ClustersHoldAboutKPointsAndStaySmall) {
  const auto points = points_on_sphere(20000, 0.1);
  for (const std::uint32_t k : {4U, 8U, 16U}) {
    const PointTree tree = cluster_points(points, {}, 4 * M_PI * 0.01, k);
    const std::size_t leaves = tree.level_offsets.back() - tree.level_offsets[tree.level_offsets.size() - 2];
    EXPECT_NEAR(20000.0 / static_cast<double>(leaves), k, 0.3 * k) << k;
    EXPECT_LE(tree.level_offsets.size() - 1, 2 + std::ceil(std::log(20000) / std::log(0.7 * k))) << k;
    // The outlier rule bounds how far a member lies from its parent point.
    const double limit = 1.5 * std::sqrt(4 * M_PI * 0.01 / 20000 * k / M_PI);
    const std::size_t first_leaf = tree.level_offsets[tree.level_offsets.size() - 2];
    for (std::size_t n = first_leaf; n < tree.first.size(); ++n) {
      const Vector& parent = points[tree.order[tree.parent_point[n]]];
      for (std::uint32_t i = tree.first[n]; i < tree.first[n] + tree.count[n]; ++i) {
        ASSERT_LE((points[tree.order[i]] - parent).norm(), limit * (1 + 1e-12));
      }
    }
  }
}

TEST(ClusterPoints, AParentPointLiesBelowItsNode) {
  const auto points = points_on_sphere(3000, 0.1);
  const PointTree tree = cluster_points(points, {}, 4 * M_PI * 0.01, 8);
  const std::size_t first_leaf = tree.level_offsets[tree.level_offsets.size() - 2];
  std::vector<std::uint32_t> low(tree.first.size());
  std::vector<std::uint32_t> high(tree.first.size());
  for (std::size_t n = tree.first.size(); n-- > 0;) {
    const std::uint32_t last = tree.first[n] + tree.count[n] - 1;
    low[n] = n >= first_leaf ? tree.first[n] : low[tree.first[n]];
    high[n] = n >= first_leaf ? last : high[last];
    ASSERT_GE(tree.parent_point[n], low[n]);
    ASSERT_LE(tree.parent_point[n], high[n]);
  }
}

TEST(ClusterPoints, ScatteredAndCoincidentPointsStillMakeATree) {
  Random random;
  std::vector<Vector> far_apart;
  for (int i = 0; i < 3000; ++i) far_apart.push_back(1000 * Vector(random.next(), random.next(), random.next()));
  expect_tree(cluster_points(far_apart, {}, 1e-3, 4), far_apart.size());
  const std::vector<Vector> same(1000, Vector(1, 2, 3));
  expect_tree(cluster_points(same, {}, 1, 4), same.size());
}

TEST(ClusterPoints, TheSamePointsGiveTheSameTree) {
  const auto points = points_on_sphere(5000, 0.1);
  const PointTree a = cluster_points(points, {}, 4 * M_PI * 0.01, 8);
  const PointTree b = cluster_points(points, {}, 4 * M_PI * 0.01, 8);
  EXPECT_EQ(a.order, b.order);
  EXPECT_EQ(a.first, b.first);
  EXPECT_EQ(a.parent_point, b.parent_point);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/find_hulls.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "bake/stages/pack_sections.h"
#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr double kVoxel = 0.001;
constexpr std::uint32_t kBranching = 14;

// The pointshell and tree of a mesh, as `bake` makes them.
struct Shell {
  Scene scene;
  Pointshell shell;
  PointTree tree;
  std::vector<Point3f> points;
  NodeHulls hulls;
  double flat = 0;

  explicit Shell(const TriangleMesh& mesh) : scene(mesh, kVoxel) {
    shell = sample_pointshell(scene.surface, scene.grid, scene.voxels, scene.runs, scene.field, 1.4 * kVoxel, 1);
    tree = cluster_points(shell.positions, scene.surface.area, kBranching);
    AssetInfo info;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      info.bounds_min[axis] = scene.surface.bounds_min[static_cast<Eigen::Index>(axis)];
      info.bounds_max[axis] = scene.surface.bounds_max[static_cast<Eigen::Index>(axis)];
    }
    describe_pointshell(shell, tree, kBranching, info);
    points = tree_points(shell, tree, info);
    flat = kHullTolerance * info.covering_radius;
    hulls = find_hulls(tree, points, flat);
  }
  [[nodiscard]] std::uint32_t corners(std::uint32_t node) const {
    return hulls.offsets[node + 1] - hulls.offsets[node];
  }
  [[nodiscard]] Vector point(std::uint32_t i) const { return {points[i][0], points[i][1], points[i][2]}; }
  // Points below a node, in tree order.
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> below(std::uint32_t node) const {
    const std::uint32_t leaves = tree.level_offsets[tree.level_offsets.size() - 2];
    std::uint32_t first = node;
    std::uint32_t last = node;
    while (first < leaves) {
      first = tree.first[first];
      last = tree.first[last] + tree.count[last] - 1;
    }
    return {tree.first[first], tree.first[last] + tree.count[last]};
  }
};

TEST(FindHulls, MostOfAFaceLiesBelowFlatNodesAndARoundBodyHasNone) {
  const Shell box(make_box({0.05, 0.045, 0.04}));
  std::vector<bool> is_below(box.points.size(), false);
  for (std::uint32_t node = 0; node < box.tree.first.size(); ++node) {
    if (box.corners(node) == 0) continue;
    const auto [first, last] = box.below(node);
    std::fill(is_below.begin() + first, is_below.begin() + last, true);
  }
  EXPECT_GT(3 * std::ranges::count(is_below, true), static_cast<std::ptrdiff_t>(is_below.size()));
  EXPECT_TRUE(Shell(make_sphere(0.02, 4)).hulls.points.empty());
}

// Proves the promise with the support function: no place is farther outside in any direction.
TEST(FindHulls, EveryPointBelowANodeIsNearTheHullOfItsCorners) {
  Random random;
  for (const TriangleMesh& mesh : {make_box({0.05, 0.045, 0.04}), make_torus(0.1, 0.05, 8, 6)}) {
    const Shell s(mesh);
    std::size_t nodes = 0;
    for (std::uint32_t node = 0; node < s.tree.first.size(); ++node) {
      if (s.corners(node) == 0) continue;
      ++nodes;
      const auto [first, last] = s.below(node);
      EXPECT_LT(4 * (s.corners(node) - 1), last - first + 4);
      for (std::uint32_t k = s.hulls.offsets[node]; k < s.hulls.offsets[node + 1]; ++k) {
        EXPECT_GE(s.hulls.points[k], first);
        EXPECT_LT(s.hulls.points[k], last);
        if (k == s.hulls.offsets[node]) continue;
        EXPECT_GT(s.hulls.points[k], s.hulls.points[k - 1]);
      }
      for (int n = 0; n < 40; ++n) {
        const Vector along = Vector(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)).normalized();
        double farthest = -1;
        for (std::uint32_t k = s.hulls.offsets[node]; k < s.hulls.offsets[node + 1]; ++k) {
          farthest = std::max(farthest, along.dot(s.point(s.hulls.points[k])));
        }
        for (std::uint32_t i = first; i < last; ++i) ASSERT_LE(along.dot(s.point(i)), farthest + 2 * s.flat) << node;
      }
    }
    EXPECT_GT(nodes, 10U);
  }
}

}  // namespace
}  // namespace vps::test

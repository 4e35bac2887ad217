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
    shell = sample_pointshell(scene.surface, find_corners(scene.surface, scene.grid.voxel_size), scene.grid,
                              scene.voxels, scene.runs, scene.field, 1.4 * kVoxel, 1);
    tree = cluster_points(shell.positions, shell.faces, scene.surface.area, kBranching);
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

TriangleMesh slanting(TriangleMesh mesh) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(0.83, Vector(1, 2, 3).normalized()).toRotationMatrix();
  for (auto& vertex : mesh.vertices) {
    const Vector v = rotation * Vector(vertex[0], vertex[1], vertex[2]);
    vertex = {v.x(), v.y(), v.z()};
  }
  return mesh;
}

std::uint32_t faces_of(const Shell& s) {
  return *std::max_element(s.shell.faces.begin(), s.shell.faces.end());
}

void expect_a_node_for_each_face(const Shell& s) {
  ASSERT_EQ(faces_of(s), 6U);
  std::map<std::uint32_t, std::size_t> sizes;
  for (const std::uint32_t face : s.shell.faces) ++sizes[face];
  // A band of few voxels along the edges is in no face.
  EXPECT_LT(4 * sizes[0], s.points.size());
  std::set<std::uint32_t> found;
  for (std::uint32_t node = 0; node < s.tree.first.size(); ++node) {
    const auto [begin, end] = s.below(node);
    const std::uint32_t face = s.shell.faces[s.tree.order[begin]];
    if (face == 0 || end - begin != sizes[face]) continue;
    const bool is_one = std::all_of(s.tree.order.begin() + begin, s.tree.order.begin() + end,
                                    [&](std::uint32_t point) { return s.shell.faces[point] == face; });
    if (!is_one || !found.insert(face).second) continue;
    EXPECT_GE(s.corners(node), 4U) << face;
    const Vector stored = s.shell.inward_normals[s.tree.order[begin]];
    const auto& normals = s.scene.surface.normals;
    const Vector normal = -*std::ranges::min_element(normals, {}, [&](const Vector& n) { return n.dot(stored); });
    for (std::uint32_t i = begin; i < end; ++i) {
      ASSERT_NEAR(normal.dot(s.point(i) - s.point(begin)), 0, s.flat);
      ASSERT_LE((s.shell.inward_normals[s.tree.order[i]] - normal).norm(), double{kPatchNormal});
    }
  }
  EXPECT_EQ(found.size(), 6U);
}

TEST(FindFaces, EachFaceIsANodeOfItsOwn) {
  expect_a_node_for_each_face(Shell(make_box({0.03, 0.025, 0.02})));
}

// Codes of normals are farther from a slanting face's normal than the points of a face may be.
TEST(FindFaces, EachSlantingFaceIsANodeOfItsOwn) {
  const Shell s(slanting(make_box({0.03, 0.025, 0.02})));
  expect_a_node_for_each_face(s);
  std::map<std::uint32_t, Vector> normals;
  for (std::size_t i = 0; i < s.shell.faces.size(); ++i) {
    if (s.shell.faces[i] == 0) continue;
    const Vector& normal = normals.emplace(s.shell.faces[i], s.shell.inward_normals[i]).first->second;
    ASSERT_EQ(s.shell.inward_normals[i], normal) << i;
  }
}

TEST(FindFaces, StripsAndCurvedSurfacesHaveNone) {
  // The narrow sides are 8 voxels wide, less what lies near the edges.
  EXPECT_EQ(faces_of(Shell(make_box({0.03, 0.025, 0.004}))), 2U);
  EXPECT_EQ(faces_of(Shell(make_sphere(0.02, 5))), 0U);
}

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

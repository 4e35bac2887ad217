// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/box_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/repair/topology.h"
#include "tests/support/random.h"

namespace vps::test {

using namespace bake;
namespace {

Vector random_place(Random& random) {
  return {random.next(), random.next(), random.next()};
}

Mesh scattered(Random& random, int triangles) {
  Mesh mesh;
  const Vector away = random.next() < 0.5 ? Vector(1e4, -2e4, 3e4) : Vector::Zero();
  for (int t = 0; t < triangles; ++t) {
    const Vector place = away + random_place(random);
    const double size = random.next() < 0.1 ? 1 : 0.02;
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(place + size * random_place(random));
    const auto first = static_cast<std::uint32_t>(3 * t);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

bool boxes_overlap(const Mesh& mesh, std::size_t a, std::size_t b) {
  Eigen::AlignedBox3d boxes[2];
  for (int k = 0; k < 3; ++k) {
    boxes[0].extend(mesh.corner(a, k));
    boxes[1].extend(mesh.corner(b, k));
  }
  return boxes[0].intersects(boxes[1]);
}

}  // namespace

TEST(BoxPairs, EveryOverlapIsFoundOnceAndFewOthers) {
  Random random(1);
  for (const int triangles : {1, 2, 15, 16, 17, 100, 300, 700}) {
    const Mesh mesh = scattered(random, triangles);
    const BoxPairs boxes(mesh);
    std::vector<TrianglePair> pairs;
    for (std::size_t part = 0; part < boxes.parts(); ++part) boxes.find(part, pairs);
    std::sort(pairs.begin(), pairs.end());
    EXPECT_EQ(std::adjacent_find(pairs.begin(), pairs.end()), pairs.end());
    std::size_t expected = 0;
    for (std::uint32_t a = 0; a < mesh.triangles.size(); ++a) {
      for (std::uint32_t b = a + 1; b < mesh.triangles.size(); ++b) {
        if (!boxes_overlap(mesh, a, b)) continue;
        ++expected;
        EXPECT_TRUE(std::binary_search(pairs.begin(), pairs.end(), TrianglePair(a, b))) << a << ' ' << b;
      }
    }
    EXPECT_LE(pairs.size(), expected + expected / 100) << "of " << triangles;
  }
}

TEST(BoxPairs, BoxesThatTouchAreFoundFarFromTheOrigin) {
  Mesh mesh;
  constexpr int kStrip = 40;
  for (int i = 0; i <= kStrip; ++i) {
    for (int side = 0; side < 2; ++side) mesh.vertices.emplace_back(1e6 + 0.1 * i, 1e6 + 0.1 * side, -1e6);
  }
  for (std::uint32_t i = 0; i < kStrip; ++i) mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 2});
  const BoxPairs boxes(mesh);
  std::vector<TrianglePair> pairs;
  for (std::size_t part = 0; part < boxes.parts(); ++part) boxes.find(part, pairs);
  EXPECT_EQ(pairs.size(), std::size_t{kStrip - 1});
}

TEST(Topology, EdgesAreInTheOrderOfASort) {
  Random random(2);
  std::vector<Triangle> triangles;
  for (int t = 0; t < 500; ++t) {
    Triangle triangle;
    for (std::uint32_t& v : triangle) v = static_cast<std::uint32_t>(60 * random.next());
    triangles.push_back(triangle);
  }
  std::vector<EdgeUse> slow;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]);
      slow.push_back({std::uint64_t{low} << 32 | high, t, triangles[t][k] < triangles[t][(k + 1) % 3] ? 1U : 0U});
    }
  }
  const auto key = [](const EdgeUse& use) { return std::tuple(use.key, use.triangle, use.forward); };
  std::sort(slow.begin(), slow.end(), [&](const EdgeUse& a, const EdgeUse& b) { return key(a) < key(b); });
  const UnsetVector<EdgeUse> fast = sorted_edges(triangles);
  EXPECT_TRUE(std::equal(fast.begin(), fast.end(), slow.begin(), slow.end(),
                         [&](const EdgeUse& a, const EdgeUse& b) { return key(a) == key(b); }));
  EXPECT_TRUE(sorted_edges({}).empty());
}

}  // namespace vps::test

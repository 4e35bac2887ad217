// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/triangle_tree.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

std::vector<double> exact_distances(const Surface& surface, const Vector& p) {
  std::vector<double> distances;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    distances.push_back(
        (closest_on_triangle(p, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)) - p).norm());
  }
  return distances;
}

// All triangles within reach are found, and no other that is farther by more than the tree's error.
void expect_all_within(const TriangleTree& tree, const Vector& p, double reach, const std::vector<double>& exact) {
  std::vector<std::uint32_t> found;
  tree.find_within(p, reach, found);
  std::vector<std::uint8_t> is_found(exact.size(), 0);
  for (const std::uint32_t t : found) {
    ASSERT_LT(t, exact.size());
    ASSERT_EQ(is_found[t], 0) << "twice";
    is_found[t] = 1;
    ASSERT_LE(exact[t], (reach + 2 * tree.error()) * (1 + 1e-6));
  }
  for (std::size_t t = 0; t < exact.size(); ++t) ASSERT_TRUE(is_found[t] != 0 || exact[t] > reach) << t;
}

void expect_bounded(const TriangleMesh& mesh) {
  const Surface surface = checked(mesh);
  const double reach = 0.1;
  const TriangleTree tree(surface, reach);
  Random random(1);
  const Vector low = surface.bounds_min - Vector::Constant(reach);
  const Vector size = surface.bounds_max - surface.bounds_min + Vector::Constant(2 * reach);
  double worst = 0;
  for (int n = 0; n < 1000; ++n) {
    const Vector p = low + size.cwiseProduct(Vector(random.next(), random.next(), random.next()));
    const std::vector<double> distances = exact_distances(surface, p);
    const double exact = *std::min_element(distances.begin(), distances.end());
    worst = std::max(worst, std::abs(tree.distance(p) - exact));
    ASSERT_NEAR(tree.distance(p, exact / 2), exact / 2, tree.error());
    ASSERT_NEAR(tree.distance(p, exact + 2 * tree.error()), exact, tree.error());
    for (const double reach_here : {exact, 1.5 * exact}) expect_all_within(tree, p, reach_here, distances);
  }
  EXPECT_LE(worst, tree.error());
  EXPECT_GT(worst, tree.error() / 200) << "a bound that is far from reached would be a waste";
}

TEST(TriangleTree, DistancesAreWithinTheirErrorBoundWithEveryInstructionSet) {
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    SCOPED_TRACE(hwy::TargetName(targets & -targets));
    hwy::DisableTargets(~(targets & -targets));
    expect_bounded(make_torus(0.1, 0.04, 40, 20));
    expect_bounded(make_box({0.1, 0.07, 0.05}));
    hwy::DisableTargets(0);
  }
}

}  // namespace
}  // namespace vps::test

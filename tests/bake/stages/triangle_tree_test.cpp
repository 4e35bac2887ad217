// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/triangle_tree.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cmath>

#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

double exact_distance(const Surface& surface, const Vector& p) {
  double squared = std::numeric_limits<double>::infinity();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    squared = std::min(
        squared,
        (closest_on_triangle(p, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)) - p).squaredNorm());
  }
  return std::sqrt(squared);
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
    const double exact = exact_distance(surface, p);
    worst = std::max(worst, std::abs(tree.distance(p) - exact));
    ASSERT_NEAR(tree.distance(p, exact / 2), exact / 2, tree.error());
    ASSERT_NEAR(tree.distance(p, exact + 2 * tree.error()), exact, tree.error());
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

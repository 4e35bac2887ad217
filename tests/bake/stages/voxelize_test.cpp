// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/voxelize.h"

#include <gtest/gtest.h>

#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

using Corners = std::array<std::array<double, 3>, 3>;

TEST(Voxelize, NoCubeThatATriangleTouchesIsMissed) {
  Random random;
  int touching = 0;
  int extra = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    // In half of the trials the vertices lie on the lattice of cube corners, so that exact contact is common.
    const bool lattice = trial % 2 == 0;
    Corners corners;
    Vector v[3];
    for (int k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double x = random.between(-2, 3);
        v[k][axis] = lattice ? std::round(x) : x;
      }
      corners[static_cast<std::size_t>(k)] = to_array(v[k]);
    }
    if ((v[1] - v[0]).cross(v[2] - v[0]).norm() == 0) continue;  // the oracle needs a triangle
    const bool truth = touches_exactly(corners, {0, 0, 0}, 1);
    const bool answer = triangle_touches_cube(Vector(0.5, 0.5, 0.5), 0.5, v[0], v[1], v[2], 1e-15);
    touching += truth;
    extra += answer && !truth;
    ASSERT_TRUE(answer || !truth) << "trial " << trial << ": " << v[0].transpose() << ", " << v[1].transpose() << ", "
                                  << v[2].transpose();
  }
  EXPECT_GT(touching, kTrials / 10);
  EXPECT_EQ(extra, 0);
}

TEST(Voxelize, SurfaceVoxelsOfAWholeMeshAreThoseThatTouchItExactly) {
  const Scene scene(make_torus(0.05, 0.02, 17, 11), 0.005);
  const Grid& grid = scene.grid;
  std::uint64_t count = 0;
  for (std::uint32_t k = 0; k < grid.dims[2]; ++k) {
    for (std::uint32_t j = 0; j < grid.dims[1]; ++j) {
      for (std::uint32_t i = 0; i < grid.dims[0]; ++i) {
        bool truth = false;
        bool nearly = false;  // within rounding of the grid's coordinates
        const Vector low = grid.origin + grid.voxel_size * Vector(i, j, k);
        const Vector high = low + Vector::Constant(grid.voxel_size);
        for (std::size_t t = 0; t < scene.surface.triangles.size() && !truth; ++t) {
          const Vector& a = scene.surface.corner(t, 0);
          const Vector& b = scene.surface.corner(t, 1);
          const Vector& c = scene.surface.corner(t, 2);
          if ((a.cwiseMin(b).cwiseMin(c).array() > high.array() + 1e-12).any()) continue;
          if ((a.cwiseMax(b).cwiseMax(c).array() < low.array() - 1e-12).any()) continue;
          const Corners corners = {to_array(a), to_array(b), to_array(c)};
          truth = touches_exactly(corners, to_array(low), grid.voxel_size);
          nearly = nearly || touches_exactly(corners, to_array(low - Vector::Constant(1e-14)), grid.voxel_size + 2e-14);
        }
        const bool answer = scene.voxels.test(grid, i, j, k);
        ASSERT_TRUE(answer ? truth || nearly : !truth) << i << ' ' << j << ' ' << k;
        count += answer;
      }
    }
  }
  EXPECT_EQ(scene.voxels.count, count);
  EXPECT_GT(count, 1000U);
}

TEST(Voxelize, AFaceOnVoxelBoundariesTouchesTheVoxelsOnBothSides) {
  // The grid starts 4 voxels below the mesh: the box's faces lie exactly on voxel boundaries.
  const Scene scene(make_box({0.5, 0.5, 0.5}), 0.25);
  const std::uint32_t pad = 4;
  for (const std::uint32_t i : {pad - 1, pad, pad + 3, pad + 4}) {
    EXPECT_TRUE(scene.voxels.test(scene.grid, i, pad + 1, pad + 1)) << i;
  }
  EXPECT_FALSE(scene.voxels.test(scene.grid, pad - 2, pad + 1, pad + 1));
  EXPECT_FALSE(scene.voxels.test(scene.grid, pad + 1, pad + 1, pad + 1));
}

}  // namespace
}  // namespace vps::test

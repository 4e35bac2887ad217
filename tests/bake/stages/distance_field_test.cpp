// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/coarse_layers.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <tbb/global_control.h>

#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

// Compares every stored voxel with CGAL's distance. Voxels of bricks that are not stored must lie outside the band.
void expect_exact(const TriangleMesh& mesh, double voxel_size) {
  const Scene scene(mesh, voxel_size);
  const Oracle oracle(mesh);
  const double band = scene.field.band_inner;
  std::size_t exact = 0;
  for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const auto p = to_array(scene.grid.centre(scene.field.set.bricks[brick], voxel));
      const double truth = oracle.penetration(p);
      const double tolerance = 1e-12;
      const double value = scene.field.value(brick, voxel);
      ASSERT_EQ(scene.field.is_exact(brick, voxel), scene.field.triangle(brick, voxel) != kNoTriangle);
      if (!scene.field.is_exact(brick, voxel)) {
        ASSERT_GE(std::abs(truth), band - tolerance);
        ASSERT_EQ(value, truth > 0 ? band : -band);
      } else {
        ASSERT_NEAR(value, truth, tolerance);
        ++exact;
      }
    }
  }
  EXPECT_GT(exact, 1000U);
  std::size_t at = 0;
  for (std::uint32_t z = 0; z < scene.grid.brick_dims[2]; ++z) {
    for (std::uint32_t y = 0; y < scene.grid.brick_dims[1]; ++y) {
      for (std::uint32_t x = 0; x < scene.grid.brick_dims[0]; ++x, ++at) {
        if (scene.field.set.index[at] != kNoBrick) continue;
        for (std::uint32_t voxel = 0; voxel < kBrickVoxels; voxel += 7) {
          ASSERT_GT(oracle.distance(to_array(scene.grid.centre(Index3{x, y, z}, voxel))), band - 1e-12);
        }
      }
    }
  }
}

TEST(DistanceField, DistancesInTheBandAreExactOnASphere) {
  expect_exact(make_sphere(0.1, 3), 0.005);
}
TEST(DistanceField, DistancesInTheBandAreExactOnLargeTriangles) {
  expect_exact(make_box({0.1, 0.07, 0.05}), 0.004);
}
TEST(DistanceField, DistancesInTheBandAreExactRoundACavity) {
  expect_exact(with_cavity(make_torus(0.1, 0.05, 20, 12), make_torus(0.1, 0.02, 20, 12)), 0.006);
}

TEST(DistanceField, GradientsPointInwardAndMatchTheSphere) {
  const Scene scene(make_sphere(0.1, 4), 0.005);
  for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const Vector gradient =
          exact_gradient(scene.surface, scene.grid.centre(scene.field.set.bricks[brick], voxel),
                         scene.field.triangle(brick, voxel), scene.field.value(brick, voxel) > 0, 0.005);
      if (!scene.field.is_exact(brick, voxel)) {
        ASSERT_EQ(gradient.norm(), 0);
        continue;
      }
      const Vector inward = -scene.grid.centre(scene.field.set.bricks[brick], voxel).normalized();
      ASSERT_NEAR(gradient.norm(), 1, 1e-9);
      ASSERT_GT(gradient.dot(inward), 0.99);
    }
  }
}

TEST(DistanceField, OnlyExactVoxelsTakeMemory) {
  const Scene scene(make_sphere(0.1, 3), 0.005);
  std::size_t exact = 0;
  for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
    std::size_t of_brick = exact;
    scene.field.for_each_exact(brick, [&](std::uint32_t voxel, std::size_t place) {
      ASSERT_TRUE(scene.field.is_exact(brick, voxel));
      ASSERT_EQ(scene.field.at(brick, voxel), place);
      ASSERT_EQ(place, of_brick++);
    });
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) exact += scene.field.is_exact(brick, voxel) ? 1 : 0;
    ASSERT_EQ(of_brick, exact);
  }
  EXPECT_EQ(scene.field.penetration.size(), exact);
  EXPECT_EQ(scene.field.closest.size(), exact);
}

void expect_bounds(const Scene& scene, const Oracle& oracle, std::uint32_t edge) {
  const auto layers = coarse_layers(scene.grid, scene.voxels, scene.runs, edge);
  std::uint32_t blocks[3];
  for (std::size_t axis = 0; axis < 3; ++axis) blocks[axis] = (scene.grid.dims[axis] + edge - 1) / edge;
  ASSERT_EQ(layers.size(), std::size_t{blocks[0]} * blocks[1] * blocks[2]);
  const double s = scene.grid.voxel_size;
  for (std::size_t n = 0; n < layers.size(); ++n) {
    const Vector block(static_cast<double>(n % blocks[0]), static_cast<double>(n / blocks[0] % blocks[1]),
                       static_cast<double>(n / blocks[0] / blocks[1]));
    const double truth = oracle.penetration(to_array(scene.grid.origin + edge * s * (block + Vector::Constant(0.5))));
    ASSERT_GE(layers[n] * truth, 0) << n;
    ASSERT_LE(std::abs(layers[n]) * s, std::abs(truth)) << n;
    ASSERT_GT((std::abs(layers[n]) + 3) * s, std::abs(truth) * (1 - 1e-8)) << n;
  }
}

// Rows are cut into parts of 32 blocks along x. The one in the middle has no surface.
TEST(DistanceField, CoarseLayersOfALongGridDoNotDependOnItsParts) {
  const TriangleMesh mesh =
      joined(make_box({0.06, 0.05, 0.03}, {-0.8, 0, 0}), make_box({0.06, 0.05, 0.03}, {0.8, 0, 0}));
  const Scene scene(mesh, 0.002);
  ASSERT_GT(scene.grid.brick_dims[0], 96U);
  const Oracle oracle(mesh);
  for (const std::uint32_t edge : {kBrickEdge, kCoarseEdge}) expect_bounds(scene, oracle, edge);
}

TEST(DistanceField, CoarseLayersNeverClaimMoreDistanceThanThereIs) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  const Scene scene(mesh, 0.002);
  const Oracle oracle(mesh);
  expect_bounds(scene, oracle, kCoarseEdge);
  const auto layers = coarse_layers(scene.grid, scene.voxels, scene.runs, kBrickEdge);
  std::size_t inner = 0;
  for (std::uint32_t z = 0; z < scene.grid.brick_dims[2]; ++z) {
    for (std::uint32_t y = 0; y < scene.grid.brick_dims[1]; ++y) {
      for (std::uint32_t x = 0; x < scene.grid.brick_dims[0]; ++x) {
        const std::size_t at = scene.grid.brick_at(x, y, z);
        const double s = scene.grid.voxel_size;
        const Vector centre = scene.grid.origin + 8 * s * Vector(x + 0.5, y + 0.5, z + 0.5);
        const double truth = oracle.penetration(to_array(centre));
        if (scene.field.set.index[at] == kNoBrick) {
          ASSERT_EQ(layers[at] > 0, truth > 0);
        }
        ASSERT_LE(std::abs(layers[at]) * s, std::abs(truth));
        ASSERT_GT((std::abs(layers[at]) + 3) * s, std::abs(truth) * (1 - 1e-8));
        inner += truth > 0;
      }
    }
  }
  EXPECT_GT(inner, 10U);
}

TEST(DistanceField, TheNumberOfThreadsDoesNotMatter) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  const Scene many(mesh, 0.004);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Scene single(mesh, 0.004);
  EXPECT_EQ(many.field.penetration, single.field.penetration);
  EXPECT_EQ(many.field.closest, single.field.closest);
  EXPECT_EQ(many.field.set.index, single.field.set.index);
}

TEST(DistanceField, TheInstructionSetDoesNotMatter) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  const Scene best(mesh, 0.004);
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    hwy::DisableTargets(~(targets & -targets));
    const Scene other(mesh, 0.004);
    hwy::DisableTargets(0);
    EXPECT_EQ(best.field.penetration, other.field.penetration) << hwy::TargetName(targets & -targets);
    EXPECT_EQ(best.field.closest, other.field.closest) << hwy::TargetName(targets & -targets);
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/fill_layers.h"

#include <gtest/gtest.h>

#include "bake/repair/winding.h"
#include "bake/vps_bake.h"
#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

// Compares the side of every voxel centre with the oracle's.
void expect_sides_match(const TriangleMesh& mesh, double voxel_size) {
  const Scene scene(mesh, voxel_size);
  const Oracle oracle(mesh);
  const InsideTest inside(scene.surface, scene.grid);
  std::uint64_t count = 0;
  for (std::uint32_t k = 0; k < scene.grid.dims[2]; ++k) {
    for (std::uint32_t j = 0; j < scene.grid.dims[1]; ++j) {
      for (std::uint32_t i = 0; i < scene.grid.dims[0]; ++i) {
        const Vector centre = scene.grid.centre(i, j, k);
        const int side = oracle.side(to_array(centre));
        const bool answer = scene.runs.test(scene.grid, i, j, k);
        count += answer;
        if (side == 0) continue;
        ASSERT_EQ(answer, side > 0) << i << ' ' << j << ' ' << k;
        ASSERT_EQ(inside.inside(centre), side > 0) << i << ' ' << j << ' ' << k;
      }
    }
  }
  EXPECT_EQ(scene.runs.count, count);
  EXPECT_GT(count, 0U);
}

TEST(InsideTest, PointsAHairFromAFaceHaveTheirSide) {
  Random random(1);
  for (int n = 0; n < 30; ++n) {
    // Faces at places that no float has.
    const std::array<double, 3> half{0.1 + random.next(), 0.1 + random.next(), 0.1 + random.next()};
    const Surface surface = checked(make_box(half));
    const InsideTest inside(surface, column_grid(surface));
    for (int face = 0; face < 6; ++face) {
      Vector p(0.013, -0.017, 0.011);
      for (const double hair : {1e-14, 1e-9, -1e-14, -1e-9}) {
        p[face / 2] = (face % 2 != 0 ? 1 : -1) * (half[static_cast<std::size_t>(face / 2)] - hair);
        ASSERT_EQ(inside.inside(p), hair > 0) << face << ' ' << hair;
      }
    }
  }
}

TEST(FillLayers, SidesOfASphereMatchTheOracle) {
  expect_sides_match(make_sphere(0.1, 2), 0.01);
}
TEST(FillLayers, TheHoleOfATorusIsOutside) {
  expect_sides_match(make_torus(0.1, 0.03, 24, 12), 0.008);
}
TEST(FillLayers, ACavityIsOutside) {
  expect_sides_match(with_cavity(make_sphere(0.1, 2), make_box({0.03, 0.02, 0.04})), 0.01);
}
TEST(FillLayers, LinesThroughVerticesAndEdgesCountOnce) {
  // Voxel centres and mesh vertices share one lattice: every scanline runs through edges and vertices.
  expect_sides_match(make_box({0.5, 0.5, 0.5}, {0.125, 0.125, 0.125}), 0.25);
  expect_sides_match(make_sphere(1, 0), 0.25);
}

TEST(FillLayers, OverlappingShellsAreUnited) {
  const TriangleMesh mesh = joined(make_box({0.1, 0.1, 0.1}), make_box({0.1, 0.1, 0.1}, {0.1, 0.05, 0.03}));
  const Scene scene(mesh, 0.01);
  const Vector shared_point(0.05, 0.05, 0.05);
  const Vector cell = (shared_point - scene.grid.origin) / scene.grid.voxel_size;
  EXPECT_TRUE(scene.runs.test(scene.grid, static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y()),
                              static_cast<std::uint32_t>(cell.z())));
}

TEST(FillLayers, ALeakSaysWhere) {
  // The check refuses open meshes, so the surface is made by hand.
  Surface surface = checked(make_box({0.5, 0.5, 0.5}));
  std::size_t gone = 0;
  while (surface.normals[gone].x() < 0.5) ++gone;
  surface.triangles.erase(surface.triangles.begin() + static_cast<std::ptrdiff_t>(gone));
  BakeOptions options;
  options.voxel_size = 0.11;
  try {
    (void)fill_inside(surface, plan_grid(extent_of(surface, measure_creases(surface)), options).grid);
    FAIL() << "the leak went unnoticed";
  } catch (const BakeError& error) {
    EXPECT_EQ(error.stage, "fill_layers");
    EXPECT_NE(std::string(error.what()).find("the surface leaks: the line y = "), std::string::npos) << error.what();
  }
}

TEST(FillLayers, LayersAreADistanceBound) {
  const TriangleMesh mesh = make_torus(0.1, 0.03, 40, 20);
  for (const double band : {2.0, 8.0}) {
    const Scene scene(mesh, 0.006, band);
    const Oracle oracle(mesh);
    const double s = scene.grid.voxel_size;
    const std::vector<std::int8_t> layers = fill_layers(scene.voxels, scene.field.inside, scene.grid, scene.field.set);
    Random random;
    for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
      for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
        const int layer = layers[brick * kBrickVoxels + voxel];
        const Index3& b = scene.field.set.bricks[brick];
        const Vector centre = scene.grid.centre(b, voxel);
        ASSERT_EQ(layer == 0,
                  scene.voxels.test(scene.grid, b[0] * 8 + voxel % 8, b[1] * 8 + voxel / 8 % 8, b[2] * 8 + voxel / 64));
        const Vector corner(random.between(-0.5, 0.5), random.between(-0.5, 0.5), random.between(-0.5, 0.5));
        const Vector p = centre + s * corner;
        const double distance = oracle.distance(to_array(p));
        const double n = std::abs(layer);
        ASSERT_GE(distance, (n - 1) * s - 1e-12);
        ASSERT_LE(distance, std::sqrt(3.0) * (n + 1) * s + 1e-12);
        if (layer != 0) {
          ASSERT_EQ(oracle.side(to_array(centre)), layer > 0 ? 1 : -1);
        }
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

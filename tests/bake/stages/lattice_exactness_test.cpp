// SPDX-License-Identifier: GPL-3.0-or-later
// Exactness in the hardest cases: vertices on voxel corners, edges along voxel diagonals, folds, layers.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/bake/stages/exactness.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr std::size_t kEveryVoxel = 10'000'000;

// With vertices on voxel corners its edges are diagonals of voxel faces. With powers of two the lattice is exact.
TriangleMesh octahedron(double radius, const std::array<double, 3>& centre) {
  TriangleMesh mesh;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      mesh.vertices.push_back(centre);
      mesh.vertices.back()[axis] += sign * radius;
    }
  }
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  return mesh;
}

// Compares all voxels: none is missed, and on an exact lattice none is set without a touching triangle.
void expect_surface_voxels_are_exact(const TriangleMesh& mesh, double voxel_size) {
  const Scene scene(mesh, voxel_size);
  const Grid& grid = scene.grid;
  std::size_t touched = 0;
  for (std::uint32_t k = 0; k < grid.dims[2]; ++k) {
    for (std::uint32_t j = 0; j < grid.dims[1]; ++j) {
      for (std::uint32_t i = 0; i < grid.dims[0]; ++i) {
        const Vector low = grid.origin + grid.voxel_size * Vector(i, j, k);
        const Vector high = low + Vector::Constant(grid.voxel_size);
        bool truth = false;
        for (std::size_t t = 0; t < scene.surface.triangles.size() && !truth; ++t) {
          const Vector& a = scene.surface.corner(t, 0);
          const Vector& b = scene.surface.corner(t, 1);
          const Vector& c = scene.surface.corner(t, 2);
          if ((a.cwiseMin(b).cwiseMin(c).array() > high.array()).any()) continue;
          if ((a.cwiseMax(b).cwiseMax(c).array() < low.array()).any()) continue;
          truth = touches_exactly({to_array(a), to_array(b), to_array(c)}, to_array(low), grid.voxel_size);
        }
        ASSERT_EQ(scene.voxels.test(grid, i, j, k), truth) << i << ' ' << j << ' ' << k;
        touched += truth;
      }
    }
  }
  EXPECT_GT(touched, 20U);
}

TEST(LatticeExactness, ABoxWithItsFacesOnVoxelPlanes) {
  expect_surface_voxels_are_exact(make_box({0.5, 0.75, 0.25}), 0.125);
}
TEST(LatticeExactness, ABoxWithItsFacesThroughVoxelCentres) {
  // The grid starts at the minimum corner. The box measures 9.5, 7.5 and 5.5 voxels: three faces pass through centres.
  expect_surface_voxels_are_exact(make_box({0.59375, 0.46875, 0.34375}), 0.125);
}
TEST(LatticeExactness, AnOctahedronWithItsVerticesOnVoxelCorners) {
  expect_surface_voxels_are_exact(octahedron(0.5, {0, 0, 0}), 0.125);
  // The grid starts at the minimum corner: four vertices lie on centres of voxel faces.
  expect_surface_voxels_are_exact(octahedron(0.4375, {0.0625, 0, 0}), 0.125);
}
TEST(LatticeExactness, AWedgeWithEdgesAlongVoxelDiagonals) {
  TriangleMesh wedge;
  wedge.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  wedge.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  expect_surface_voxels_are_exact(wedge, 0.125);
  expect_surface_voxels_are_exact(wedge, 0.25);
}
TEST(LatticeExactness, OctahedraThatTouchInAVertexOfTheLattice) {
  expect_surface_voxels_are_exact(joined(octahedron(0.25, {0, 0, 0}), octahedron(0.25, {0.5, 0, 0})), 0.0625);
}

// Vertices lie on multiples of half a voxel. Voxel centres lie on faces only up to rounding, as tenths are not exact in
// binary.
TEST(LatticeExactness, CentresWhoseDepthRoundsToZeroHaveTheirSide) {
  TriangleMesh mesh;
  mesh.vertices = {{1.5, 0.7, 1.0}, {1.0, 2.1, 0.9}, {0, 1.0, 2.0}, {2.4, 1.5, 1.5}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  const Effort effort{12, kEveryVoxel, 0};
  const Subject subject(Truth::side, effort, mesh);
  EXPECT_GT(std::count(subject.scene.field.penetration.begin(), subject.scene.field.penetration.end(), 0.0), 0);
  expect_distances(subject);
  expect_signs_of_cgal(subject);
}

// A face is triangulated as a fan round a point beyond its edge. Beyond the edge the triangles overlap.
TEST(FoldExactness, AFoldIsNoPartOfTheSurface) {
  TriangleMesh mesh = make_box({0.5, 0.5, 0.5});
  mesh.vertices.push_back({0.75, 0, 0.5});
  const auto tip = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  std::erase_if(mesh.triangles, [](const auto& t) { return std::min({t[0], t[1], t[2]}) >= 4; });
  for (const auto& [from, to] : {std::array{4U, 5U}, {5U, 7U}, {7U, 6U}, {6U, 4U}}) {
    mesh.triangles.push_back({from, to, tip});
  }
  EXPECT_FALSE(bounds_solid(mesh, {0.75, 0, 0.5}, 1));
  EXPECT_FALSE(bounds_solid(mesh, {0.5625, 0, 0.5}, 1));
  EXPECT_TRUE(bounds_solid(mesh, {0.5, 0, 0.5}, 1));
  EXPECT_TRUE(bounds_solid(mesh, {0, 0, 0.5}, 1));
  const Effort effort{20, kEveryVoxel, 100'000};
  const Subject subject(Truth::winding, effort, mesh);
  EXPECT_EQ(subject.scene.surface.bounds_max.x(), 0.5);
  expect_distances(subject);
  expect_signs_of_winding_numbers(subject);
}

// Compares layers with the Chebyshev distance to the nearest surface voxel, found among all of them.
void expect_layers_by_brute_force(const TriangleMesh& mesh, double voxel_size, double band) {
  const Scene scene(mesh, voxel_size, band);
  const Grid& grid = scene.grid;
  std::vector<std::array<int, 3>> surface;
  for (std::uint32_t k = 0; k < grid.dims[2]; ++k) {
    for (std::uint32_t j = 0; j < grid.dims[1]; ++j) {
      for (std::uint32_t i = 0; i < grid.dims[0]; ++i) {
        if (!scene.voxels.test(grid, i, j, k)) continue;
        surface.push_back({static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)});
      }
    }
  }
  const std::vector<std::int8_t> layers = fill_layers(scene.voxels, scene.field.inside, grid, scene.field.set);
  const Oracle oracle(mesh);
  std::size_t seen = 0;
  for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
    const Index3& b = scene.field.set.bricks[brick];
    // Tests every third voxel; bricks start at voxel 0, 1 or 2.
    for (std::uint32_t voxel = static_cast<std::uint32_t>(brick % 3); voxel < kBrickVoxels; voxel += 3) {
      const int at[3] = {static_cast<int>(b[0] * 8 + voxel % 8), static_cast<int>(b[1] * 8 + voxel / 8 % 8),
                         static_cast<int>(b[2] * 8 + voxel / 64)};
      int nearest = 1 << 20;
      for (const auto& v : surface) {
        nearest = std::min(nearest, std::max({std::abs(v[0] - at[0]), std::abs(v[1] - at[1]), std::abs(v[2] - at[2])}));
      }
      const int layer = layers[brick * kBrickVoxels + voxel];
      ASSERT_EQ(std::abs(layer), nearest) << at[0] << ' ' << at[1] << ' ' << at[2];
      const auto centre = to_array(grid.centre(b, voxel));
      if (layer != 0) {
        ASSERT_EQ(oracle.side(centre), layer > 0 ? 1 : -1);
        ASSERT_GE(oracle.distance(centre), (nearest - 0.5) * voxel_size * (1 - 1e-12));
      }
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000U);
}

TEST(LayerExactness, LayersAreChebyshevDistancesToTheNearestSurfaceVoxel) {
  expect_layers_by_brute_force(make_torus(0.1, 0.03, 24, 12), 0.012, 2.5);
  expect_layers_by_brute_force(make_box({0.5, 0.75, 0.25}), 0.125, 2.0);
  expect_layers_by_brute_force(octahedron(1, {0, 0, 0}), 0.125, 8.0);
  expect_layers_by_brute_force(with_cavity(make_sphere(0.1, 2), make_box({0.03, 0.02, 0.04})), 0.01, 4.0);
}

}  // namespace
}  // namespace vps::test

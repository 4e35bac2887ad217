// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Compares a baked mesh with independent oracles: distances, signs, surface voxels and coarse layers.
#pragma once

#include <optional>

#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;

/// The oracle for the inside of a mesh.
enum class Truth {
  side,     ///< no self-intersections, one shell or disjoint ones: CGAL's Side_of_triangle_mesh
  winding,  ///< shells that cross, or edges that CGAL's mesh cannot store: solid angles of the imported triangles
};

/// How much is compared: only the slow tests compare all stored voxels.
struct Effort {
  double resolution;
  std::size_t voxels;
  std::size_t winding_work;  ///< largest number of solid angles per comparison
};

struct StoredVoxel {
  std::size_t brick;
  std::uint32_t voxel;
};

/// A mesh, its baked stages and its oracles.
struct Subject {
  const Effort& effort;
  TriangleMesh mesh;     // as imported
  Scene scene;           // as baked
  TriangleMesh surface;  // after the check
  SoupOracle distance;
  std::optional<Oracle> side;
  double size;

  Subject(Truth truth, const Effort& e, TriangleMesh imported);

  /// All stored voxels, or `most` of them, evenly spread.
  [[nodiscard]] std::vector<StoredVoxel> voxels(std::size_t most) const;
  /// A uniform random point in the grid.
  [[nodiscard]] Vector random_point(Random& random) const;
};

/// Whether a point of the mesh bounds the solid. It does not if it lies on a fin, a triangle folded onto its neighbour,
/// which is outside on both sides.
[[nodiscard]] bool bounds_solid(const TriangleMesh& mesh, const std::array<double, 3>& point, double size);

void expect_distances(const Subject& subject);
/// @pre the subject has the oracle `side`
void expect_signs_of_cgal(const Subject& subject);
/// A point is inside if the surface winds round it at least once. Points near the surface are skipped, as solid angles
/// are inaccurate there.
void expect_signs_of_winding_numbers(const Subject& subject);
void expect_no_voxel_missed(const Subject& subject);
void expect_far_bricks_bounded(const Subject& subject);

}  // namespace vps::test

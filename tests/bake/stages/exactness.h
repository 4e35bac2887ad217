// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A baked mesh beside independent oracles: distances, signs, surface voxels and coarse layers.
#pragma once

#include <optional>

#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;

/// Who knows the inside of a mesh.
enum class Truth {
  side,     ///< no self-intersections, one shell or disjoint ones: CGAL's Side_of_triangle_mesh
  winding,  ///< shells that cross, or edges that CGAL's mesh cannot hold: solid angles of the imported triangles
};

/// How much is looked at: all stored voxels are compared in the long run only.
struct Effort {
  double resolution;
  std::size_t voxels;
  std::size_t winding_work;  ///< triangles visited by solid angles
};

struct StoredVoxel {
  std::size_t brick;
  std::uint32_t voxel;
};

/// A mesh with everything that is compared.
struct Subject {
  const Effort& effort;
  TriangleMesh mesh;     // as imported
  Scene scene;           // as baked
  TriangleMesh surface;  // after the check
  SoupOracle distance;
  std::optional<Oracle> side;
  double size;

  Subject(Truth truth, const Effort& e, TriangleMesh imported);

  /// Every stored voxel, or some spread evenly over them.
  [[nodiscard]] std::vector<StoredVoxel> voxels(std::size_t most) const;
  /// Anywhere in the grid.
  [[nodiscard]] Vector random_point(Random& random) const;
};

/// The solid comes up to a point of the mesh. It does not where a triangle is folded onto its neighbour: such a fin is
/// outside on both its sides.
[[nodiscard]] bool bounds_solid(const TriangleMesh& mesh, const std::array<double, 3>& point, double size);

void expect_distances(const Subject& subject);
/// @pre the subject has the oracle `side`
void expect_signs_of_cgal(const Subject& subject);
/// Inside: the surface goes round the point at least once. Solid angles are trusted off the surface only.
void expect_signs_of_winding_numbers(const Subject& subject);
void expect_no_voxel_missed(const Subject& subject);
void expect_far_bricks_bounded(const Subject& subject);

}  // namespace vps::test

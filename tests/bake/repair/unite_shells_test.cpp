// SPDX-License-Identifier: GPL-3.0-or-later
// Unions of shells whose faces nearly coincide, as those of parts of an assembly do after their poses were rounded.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "bake/repair/close_mesh.h"
#include "bake/repair/resolve_shells.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using bake::Vector;

void append(bake::Mesh& mesh, const TriangleMesh& part, const Eigen::Affine3d& pose) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& v : part.vertices) mesh.vertices.emplace_back(pose * Vector(v[0], v[1], v[2]));
  for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({base + a, base + b, base + c});
}

double volume(const bake::Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += mesh.corner(t, 0).dot(mesh.area_normal(t)) / 6;
  return sum;
}

TEST(UniteShells, FacesThatNearlyCoincideGiveAClosedSurface) {
  Random random;
  int united = 0;
  for (int n = 0; n < 40; ++n) {
    // A plate on a plate, turned by next to nothing and far from the origin, with a tube through both.
    const double tilt = std::pow(10, random.between(-16, -3));
    const Vector axis = Vector(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)).normalized();
    const Eigen::Affine3d far(Eigen::Translation3d(random.between(-300, 300), random.between(-300, 300), 0.1));
    const Eigen::Affine3d turned = far * Eigen::Translation3d(0.3, 0.2, 0) * Eigen::AngleAxisd(tilt, axis);
    bake::Mesh mesh;
    append(mesh, make_box({1, 1, 0.1}), far);
    append(mesh, make_box({1, 1, 0.1}), turned);
    append(mesh, make_torus(0.5, 0.2, 24, 12), turned);
    const auto pairs = bake::self_intersections(mesh);
    const bake::ShellCounts counts = bake::resolve_shells(mesh, pairs, bake::closed_pieces(mesh.triangles));
    united += counts.united > 0;
    ASSERT_EQ(bake::count_unbalanced(mesh), 0U) << n << ' ' << tilt;
    const double all = volume(mesh);
    // Two plates that overlap by 1.7 x 1.8, and what stands out of the torus.
    ASSERT_GT(all, 0.2 * (8 - 1.7 * 1.8)) << n << ' ' << tilt;
    ASSERT_LT(all, 0.2 * (8 - 1.7 * 1.8) + 0.4) << n << ' ' << tilt;
  }
  EXPECT_EQ(united, 40);
}

// A few patches are compared with all triangles, many with those of their columns.
TEST(UniteShells, FewAndManyBoxesInARowHaveTheVolumeOfTheRow) {
  for (const int boxes : {2, 10, 60}) {
    bake::Mesh mesh;
    for (int i = 0; i < boxes; ++i)
      append(mesh, make_box({1, 1, 1}), Eigen::Affine3d(Eigen::Translation3d(0.3 * i, 1.5 * i, -0.2 * i)));
    bake::resolve_shells(mesh, bake::self_intersections(mesh), bake::closed_pieces(mesh.triangles));
    ASSERT_EQ(bake::count_unbalanced(mesh), 0U) << boxes;
    EXPECT_NEAR(volume(mesh), 8 * boxes - (2 - 0.3) * (2 - 1.5) * (2 - 0.2) * (boxes - 1), 1e-9) << boxes;
  }
}

}  // namespace
}  // namespace vps::test

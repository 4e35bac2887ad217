// SPDX-License-Identifier: GPL-3.0-or-later
// The exact cuts of shells that cross: CGAL's lazy numbers are shared by the threads.
#include <gtest/gtest.h>

#include "bake/repair/resolve_shells.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

void append(bake::Mesh& mesh, const TriangleMesh& part, const bake::Vector& offset) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& v : part.vertices) mesh.vertices.push_back(bake::Vector(v[0], v[1], v[2]) + offset);
  for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({base + a, base + b, base + c});
}

TEST(Threads, CutShellsExactly) {
  // Three tori through each other. Some of their faces coincide, and many cut planes have no exact double.
  bake::Mesh mesh;
  const TriangleMesh torus = make_torus(1, 0.3, 24, 12);
  append(mesh, torus, {0, 0, 0});
  append(mesh, torus, {0.1, 0.7, 0});
  append(mesh, torus, {0.3, 0.2, 0.1});
  const auto pairs = bake::self_intersections(mesh);
  EXPECT_GT(pairs.size(), 500U);
  EXPECT_EQ(bake::resolve_shells(mesh, pairs, bake::closed_pieces(mesh.triangles)).united, 3U);
  EXPECT_GT(mesh.triangles.size(), 1000U);
}

}  // namespace
}  // namespace vps::test

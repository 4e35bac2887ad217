// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/check.h"

#include <gtest/gtest.h>

#include <limits>

#include "bake/vps_bake.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

std::string refusal(const TriangleMesh& mesh) {
  std::vector<std::string> notes;
  try {
    (void)check_mesh(mesh, notes);
  } catch (const BakeError& error) {
    EXPECT_EQ(error.stage, "check");
    return error.what();
  }
  return "";
}

TEST(Check, AClosedMeshPassesWithoutNotes) {
  std::vector<std::string> notes;
  const Surface surface = check_mesh(make_box({1, 2, 3}), notes);
  EXPECT_TRUE(notes.empty());
  EXPECT_EQ(surface.triangles.size(), 12U);
  EXPECT_DOUBLE_EQ(surface.area, 8 * (2 + 3 + 6));
}

TEST(Check, AnOpenMeshIsRefusedWithThePlaceOfTheHole) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.triangles.pop_back();
  EXPECT_NE(refusal(mesh).find("the mesh is open: 3 edges"), std::string::npos) << refusal(mesh);
  EXPECT_NE(refusal(mesh).find("the first at (1, "), std::string::npos) << refusal(mesh);
}

TEST(Check, AFlippedTriangleIsRefused) {
  TriangleMesh mesh = make_box({1, 1, 1});
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  EXPECT_NE(refusal(mesh).find("wound in opposite directions at 3 edges"), std::string::npos) << refusal(mesh);
}

TEST(Check, AnInsideOutMeshIsRightedAndSaid) {
  TriangleMesh mesh = make_box({1, 1, 1});
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  std::vector<std::string> notes;
  const Surface surface = check_mesh(mesh, notes);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("inside out"), std::string::npos);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    EXPECT_GT(surface.normals[t].dot(surface.corner(t, 0)), 0);
  }
}

TEST(Check, NonFiniteCoordinatesAreRefused) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    TriangleMesh mesh = make_box({1, 1, 1});
    mesh.vertices[5][1] = bad;
    EXPECT_NE(refusal(mesh).find("vertex 5 is not finite"), std::string::npos);
  }
}

TEST(Check, NothingAndFlatThingsAreRefused) {
  EXPECT_NE(refusal({}).find("no triangle with an area"), std::string::npos);
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_NE(refusal(flat).find("encloses no volume"), std::string::npos);
}

TEST(Check, IndicesPastTheEndAreRefused) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.triangles[0][0] = 99;
  EXPECT_NE(refusal(mesh).find("not there"), std::string::npos);
}

TEST(Check, DuplicateVerticesAreJoinedAndCollapsedTrianglesDropped) {
  TriangleMesh soup;
  const TriangleMesh box = make_box({1, 1, 1});
  for (const auto& t : box.triangles) {
    const auto base = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(box.vertices[v]);
    soup.triangles.push_back({base, base + 1, base + 2});
  }
  soup.triangles.push_back({0, 0, 1});
  soup.vertices.push_back({50, 50, 50});  // unused: must not widen the bounds
  std::vector<std::string> notes;
  const Surface surface = check_mesh(soup, notes);
  EXPECT_EQ(surface.vertices.size(), 8U);
  EXPECT_EQ(surface.triangles.size(), 12U);
  EXPECT_EQ(surface.bounds_max, Vector(1, 1, 1));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0], "dropped 1 collapsed triangles");
}

}  // namespace
}  // namespace vps::test

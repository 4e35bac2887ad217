// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/check.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "bake/stages/mass_properties.h"
#include "tests/support/shapes.h"

namespace vps::test {

using namespace bake;
namespace {

std::string refusal(const TriangleMesh& mesh, const RepairSettings& settings = {}) {
  RepairOutcome outcome;
  try {
    (void)check_mesh(mesh, settings, outcome);
  } catch (const BakeError& error) {
    EXPECT_EQ(error.stage, "check");
    return error.what();
  }
  return "";
}

void expect_outward_box(const Surface& surface, const Vector& half) {
  EXPECT_NEAR(mass_properties(surface).volume, 8 * half.prod(), 1e-12);
  EXPECT_NEAR(surface.area, 8 * (half.x() * half.y() + half.y() * half.z() + half.z() * half.x()), 1e-12);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    EXPECT_GT(surface.normals[t].dot(surface.corner(t, 0)), 0);
  }
}

TEST(Check, AClosedMeshPassesWithoutNotes) {
  RepairOutcome outcome;
  const Surface surface = check_mesh(make_box({1, 2, 3}), {}, outcome);
  const std::vector<std::string>& notes = outcome.notes;
  EXPECT_TRUE(notes.empty());
  EXPECT_EQ(surface.triangles.size(), 12U);
  EXPECT_DOUBLE_EQ(surface.area, 8 * (2 + 3 + 6));
}

TEST(Check, AnOpenMeshIsRefusedWithThePlaceOfTheHole) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.triangles.pop_back();
  const std::string said = refusal(mesh, {Repair::stitch});
  EXPECT_NE(said.find("it leaks through 1 hole, the longest border of 6.828 m at (1, "), std::string::npos) << said;
  EXPECT_NE(said.find("--repair fill"), std::string::npos) << said;
}

TEST(Check, AFlippedTriangleIsTurned) {
  TriangleMesh mesh = make_box({1, 1, 1});
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  RepairOutcome outcome;
  const Surface surface = check_mesh(mesh, {}, outcome);
  expect_outward_box(surface, {1, 1, 1});
  EXPECT_EQ(outcome.notes, std::vector<std::string>{"turned 1 triangles wound against their neighbours"});
}

TEST(Check, AnInsideOutMeshIsRightedAndSaid) {
  TriangleMesh mesh = make_box({1, 1, 1});
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  RepairOutcome outcome;
  const Surface surface = check_mesh(mesh, {}, outcome);
  const std::vector<std::string>& notes = outcome.notes;
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
  EXPECT_NE(refusal({}).find("the mesh has no triangles"), std::string::npos);
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  flat.triangles = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_NE(refusal(flat).find("the mesh is open"), std::string::npos);
}

TEST(Check, AMisplacedVertexIsRefusedWithItsPlace) {
  for (TriangleMesh mesh : {make_box({1, 1, 1}), make_sphere(1, 4)}) {
    mesh.vertices[3][1] = 1e7;
    for (const double voxel_size : {0.0, 1e7 / 160}) {
      const std::string said = refusal(mesh, {Repair::automatic, voxel_size, 0});
      EXPECT_NE(said.find("a vertex at ("), std::string::npos) << said;
      EXPECT_NE(said.find("1e+07, "), std::string::npos) << said;
      EXPECT_NE(said.find("lies up to 1e+04 km from all others"), std::string::npos) << said;
    }
  }
}

TEST(Check, ASmallPartOfManyTrianglesBesideALargeOneIsNotMisplaced) {
  const TriangleMesh scene = joined(make_box({1000, 1, 1}), make_sphere(0.5, 4));
  EXPECT_EQ(refusal(scene, {Repair::automatic, 20, 0}), "");
}

TEST(Check, SliversHaveARightVolumeOrNone) {
  int refused = 0;
  for (int n = 4; n < 48; ++n) {
    const double t = std::pow(10, -n / 4.0);
    for (const Vector& half : {Vector(0.5, t, t), Vector(0.5, 0.5, t)}) {
      // Along an axis, where rounding is harmless, and across all three.
      for (const double angle : {0.0, 0.6}) {
        const Eigen::AngleAxisd pose(angle, Vector(0.3, -0.5, 0.8).normalized());
        TriangleMesh mesh = make_box({half.x(), half.y(), half.z()});
        for (auto& v : mesh.vertices) {
          const Vector p = pose * Vector(v[0], v[1], v[2]);
          v = {p.x(), p.y(), p.z()};
        }
        RepairOutcome outcome;
        try {
          const Surface surface = check_mesh(mesh, {}, outcome);
          const double volume = mass_properties(surface).volume;
          EXPECT_NEAR(volume, 8 * half.prod(), 0.01 * volume) << t << ' ' << angle;
        } catch (const BakeError& error) {
          EXPECT_NE(std::string(error.what()).find("encloses no volume"), std::string::npos) << error.what();
          EXPECT_LT(half.prod(), 1e-12);
          ++refused;
        }
      }
    }
  }
  EXPECT_GT(refused, 0);
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
  RepairOutcome outcome;
  const Surface surface = check_mesh(soup, {}, outcome);
  const std::vector<std::string>& notes = outcome.notes;
  EXPECT_EQ(surface.vertices.size(), 8U);
  EXPECT_EQ(surface.triangles.size(), 12U);
  EXPECT_EQ(surface.bounds_max, Vector(1, 1, 1));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_EQ(notes[0], "dropped 1 collapsed triangles");
}

}  // namespace
}  // namespace vps::test

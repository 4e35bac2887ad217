// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "bake/repair/check.h"
#include "bake/stages/mass_properties.h"
#include "formats/mesh/mesh_import.h"
#include "sample_meshes/shapes.h"
#include "tests/sample_meshes/mesh_checks.h"
#include "tests/support/oracle.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

using namespace bake;
namespace {

struct Expected {
  const char* name;
  int genus;
  std::size_t triangles;
  double volume;     // [m^3]
  double tolerance;  // relative
};

void PrintTo(const Expected& expected, std::ostream* out) {
  *out << expected.name;
}

// Volumes of the ideal shapes; the facets reduce them slightly. For threads and teeth the mean outline is used.
const Expected kSamples[] = {
    {"cube", 0, 12, 1e-3, 1e-6},
    {"icosphere", 0, 5120, 4.0 / 3 * M_PI * 0.05 * 0.05 * 0.05, 0.005},
    {"torus", 1, 4096, 2 * M_PI* M_PI * 0.05 * 0.02 * 0.02, 0.01},
    {"bolt", 0, 5976, 2 * std::sqrt(3.0) * 0.008 * 0.008 * 0.0064 + M_PI * 0.00454 * 0.00454 * 0.015, 0.02},
    {"nut", 1, 3096, (2 * std::sqrt(3.0) * 0.008 * 0.008 - M_PI * 0.00469 * 0.00469) * 0.0075, 0.02},
    {"gear", 1, 1280, M_PI*(0.01985 * 0.01985 - 0.005 * 0.005) * 0.008, 0.02},
    {"peg", 0, 256, M_PI * 0.0039 * 0.0039 * 0.03, 0.005},
    {"hole", 1, 512, (0.0004 - M_PI * 0.004 * 0.004) * 0.02, 0.005},
    {"thin_plate", 0, 12, 5e-6, 1e-6},
};

class SampleMeshes : public testing::TestWithParam<Expected> {
 protected:
  static std::filesystem::path file(const char* name) {
    return std::filesystem::path(VPS_SAMPLE_MESHES) / (std::string(name) + ".obj");
  }
};

TEST_P(SampleMeshes, AreClosedManifoldOutwardAndSimple) {
  const TriangleMesh mesh = import_mesh(file(GetParam().name));
  EXPECT_EQ(mesh.triangles.size(), GetParam().triangles);
  std::map<std::array<std::uint32_t, 2>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, uses] : edges) {
    ASSERT_EQ(uses, 1);
    ASSERT_TRUE(edges.contains({edge[1], edge[0]}));
  }
  const auto euler = static_cast<int>(mesh.vertices.size()) - static_cast<int>(edges.size() / 2) +
                     static_cast<int>(mesh.triangles.size());
  EXPECT_EQ(euler, 2 - 2 * GetParam().genus);
  EXPECT_FALSE(intersects_itself(mesh));

  RepairOutcome outcome;
  const Surface surface = check_mesh(mesh, {}, outcome);
  EXPECT_TRUE(outcome.notes.empty()) << outcome.notes[0];  // nothing dropped, nothing turned
  EXPECT_NEAR(mass_properties(surface).volume, GetParam().volume, GetParam().tolerance * GetParam().volume);
}

TEST_P(SampleMeshes, AreWhatTheGeneratorWrites) {
  const TemporaryFolder folder;
  ASSERT_EQ(std::system((std::string(VPS_GENERATOR) + " " + folder.path().string()).c_str()), 0);
  EXPECT_EQ(folder.names().size(), std::size(kSamples));
  EXPECT_EQ(read_file(folder / (std::string(GetParam().name) + ".obj")), read_file(file(GetParam().name)));
}

INSTANTIATE_TEST_SUITE_P(All, SampleMeshes, testing::ValuesIn(kSamples),
                         [](const auto& test) { return std::string(test.param.name); });

// Smallest distance from the vertices of one mesh to another mesh; negative if a vertex lies inside.
double clearance(const TriangleMesh& moving, const TriangleMesh& fixed, std::array<double, 3> shift) {
  const Oracle oracle(fixed);
  double least = 1e9;
  for (const auto& v : moving.vertices) {
    least = std::min(least, -oracle.penetration({v[0] + shift[0], v[1] + shift[1], v[2] + shift[2]}));
  }
  return least;
}

TEST(SampleFits, TheNutSitsOnTheBoltWithoutTouchingIt) {
  const double gap = clearance(samples::make_nut(), samples::make_bolt(), {0, 0, 0});
  // A radial clearance of 0.15 mm is less across the flanks.
  EXPECT_GT(gap, 0.00005);
  EXPECT_LE(gap, samples::kThreadClearance + 1e-9);
  EXPECT_GT(clearance(samples::make_bolt(), samples::make_nut(), {0, 0, 0}), 0.00005);
}

TEST(SampleFits, ANutMovedHalfAPitchCutsIntoTheThread) {
  EXPECT_LT(clearance(samples::make_nut(), samples::make_bolt(), {0, 0, samples::kM10.pitch / 2}), -0.0002);
}

TEST(SampleFits, ThePegIsATenthOfAMillimetreClearOfTheHole) {
  // Halfway in, the rings of vertices at the peg's ends lie within the block's height.
  const double gap = clearance(samples::make_peg(), samples::make_hole(), {0, 0, 0.005});
  EXPECT_GE(gap, 0.0001);
  EXPECT_LE(gap, 0.000106);
}

}  // namespace
}  // namespace vps::test

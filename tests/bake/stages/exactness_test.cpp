// SPDX-License-Identifier: GPL-3.0-or-later
// Compares signs, distances, surface voxels and layers with independent oracles, on every available closed mesh.
#include <gtest/gtest.h>

#include <algorithm>

#include "formats/mesh/mesh_import.h"
#include "tests/bake/stages/exactness.h"
#include "tests/support/shared.h"

namespace vps::test {

using namespace bake;
namespace {

/// When a mesh is tested: small ones in every run, all of them in the slow tests.
enum class When { always, slow };

struct MeshCase {
  const char* file;
  Truth truth;
  When when;
  friend void PrintTo(const MeshCase& c, std::ostream* out) { *out << c.file; }
};

// The meshes of shared/meshes/README.md without open edges, except the dragon: its duplicate triangles leave holes.
const MeshCase kClosed[] = {
    {"ADIS16480_metres.stl", Truth::side, When::always},
    {"armadillo_52k.off", Truth::side, When::always},
    {"asteroid.3ds", Truth::side, When::always},
    {"box_10_parts.stl", Truth::winding, When::slow},
    {"bunny_3k5.off", Truth::side, When::always},
    {"bunny_453.obj", Truth::side, When::always},
    {"bunny_closed.obj", Truth::winding, When::always},
    {"capsule_degenerate.obj", Truth::side, When::always},
    {"cycloidal_assembly.ply", Truth::winding, When::slow},
    {"fandisk.off", Truth::side, When::always},
    {"gearwheel_40.stl", Truth::side, When::always},
    {"man_selfintersect.off", Truth::winding, When::always},
    {"nested_instances.glb", Truth::side, When::always},
    {"nut_M3.stl", Truth::side, When::always},
    {"propeller.stl", Truth::winding, When::always},
    {"scallop_120k.glb", Truth::side, When::slow},
    {"screw_M3x10.stl", Truth::side, When::always},
    {"shape_sorter.obj", Truth::side, When::always},
    {"sliver_tet.ply", Truth::side, When::always},
    {"spool_holder.stl", Truth::side, When::always},
    {"spot.obj", Truth::side, When::always},
    {"tetra_shared_edge.obj", Truth::winding, When::always},
    {"tires_x4.stl", Truth::side, When::slow},
    {"tray_plate.stl", Truth::side, When::always},
    {"twin_offset.obj", Truth::winding, When::slow},
    {"ur5_forearm.dae", Truth::winding, When::always},
    {"ur5_upperarm_collision.stl", Truth::winding, When::always},
};

constexpr Effort kFast{60, 4000, 2'000'000};
constexpr Effort kAllVoxels{60, 10'000'000, 6'000'000};
constexpr Effort kSlow{150, 10'000'000, 300'000'000};

void expect_exact(const MeshCase& c, const Effort& effort) {
  VPS_SHARED_FILE_OR_SKIP(path, std::string("meshes/") + c.file);
  const Subject subject(c.truth, effort, import_mesh(path));
  expect_distances(subject);
  if (c.truth == Truth::side) {
    expect_signs_of_cgal(subject);
  } else {
    expect_signs_of_winding_numbers(subject);
  }
  expect_no_voxel_missed(subject);
  expect_far_bricks_bounded(subject);
}

std::vector<MeshCase> cases_of_every_run() {
  std::vector<MeshCase> cases;
  std::copy_if(std::begin(kClosed), std::end(kClosed), std::back_inserter(cases),
               [](const MeshCase& c) { return c.when == When::always; });
  return cases;
}

const auto name_of = [](const auto& test) {
  const std::string file = test.param.file;
  return file.substr(0, file.find('.'));
};

class Exactness : public testing::TestWithParam<MeshCase> {};
TEST_P(Exactness, HoldsAt60Voxels) {
  expect_exact(GetParam(), kFast);
}
INSTANTIATE_TEST_SUITE_P(Closed, Exactness, testing::ValuesIn(cases_of_every_run()), name_of);

class ExactnessSlow : public testing::TestWithParam<MeshCase> {};
TEST_P(ExactnessSlow, HoldsAt60Voxels) {
  expect_exact(GetParam(), kAllVoxels);
}
TEST_P(ExactnessSlow, HoldsAt150Voxels) {
  expect_exact(GetParam(), kSlow);
}
INSTANTIATE_TEST_SUITE_P(Closed, ExactnessSlow, testing::ValuesIn(kClosed), name_of);

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Scanned and exported meshes bake, or are refused for what is wrong with them.
#include <gtest/gtest.h>

#include "runtime/vps_runtime.h"
#include "tests/cli/program.h"
#include "tests/support/shared.h"

namespace vps::test {
namespace {

struct RealMesh {
  const char* name;
  const char* arguments;
  bool long_when_sanitized = false;
};
class RealMeshes : public testing::TestWithParam<RealMesh> {};
TEST_P(RealMeshes, Bake) {
  VPS_SHARED_FILE_OR_SKIP(meshes, "meshes");
#ifdef VPS_SANITIZE
  if (GetParam().long_when_sanitized) GTEST_SKIP() << "takes a minute under AddressSanitizer";
#endif
  const TemporaryFolder folder;
  const Outcome run = vpsbake(folder, (meshes / GetParam().arguments).string() + " --resolution 60 -o a.vps.hdf");
  EXPECT_EQ(run.code, 0) << run.err;
  Asset asset;
  EXPECT_EQ(Asset::open((folder / "a.vps.hdf").c_str(), asset), Status::ok);
}
INSTANTIATE_TEST_SUITE_P(
    Closed, RealMeshes,
    testing::Values(RealMesh{"bunny_closed", "bunny_closed.obj"}, RealMesh{"bunny_3k5", "bunny_3k5.off"},
                    RealMesh{"armadillo_52k", "armadillo_52k.off", true}, RealMesh{"spot", "spot.obj"},
                    RealMesh{"screw_M3x10", "screw_M3x10.stl"}, RealMesh{"nut_M3", "nut_M3.stl"},
                    RealMesh{"gearwheel_40", "gearwheel_40.stl"}, RealMesh{"fandisk", "fandisk.off"},
                    RealMesh{"tray_plate", "tray_plate.stl"}, RealMesh{"ADIS16480", "ADIS16480_metres.stl", true},
                    RealMesh{"tires_x4", "tires_x4.stl", true}, RealMesh{"scallop_120k", "scallop_120k.glb", true},
                    RealMesh{"asteroid", "asteroid.3ds"}, RealMesh{"capsule_degenerate", "capsule_degenerate.obj"},
                    RealMesh{"sliver_tet", "sliver_tet.ply"}, RealMesh{"shape_sorter", "shape_sorter.obj"},
                    RealMesh{"man_selfintersect", "man_selfintersect.off", true},
                    RealMesh{"nested_instances", "nested_instances.glb"},
                    RealMesh{"ur5_upperarm", "ur5_upperarm_collision.stl"}, RealMesh{"propeller", "propeller.stl"},
                    RealMesh{"milk_truck", "milk_truck.glb"}, RealMesh{"bearing", "bearing.stl --repair fill"},
                    RealMesh{"teapot", "teapot.obj"}, RealMesh{"teapot_wrapped", "teapot.obj --repair wrap"},
                    RealMesh{"franka_link5", "franka_link5.dae"},
                    RealMesh{"half_tunnel", "half_tunnel.off --scale 0.01 --open-surface thicken=4mm"},
                    RealMesh{"truck_soup", "truck_soup.obj --repair wrap", true}),
    [](const auto& mesh) { return std::string(mesh.param.name); });

TEST(Cli, RealMeshesAreRefusedForWhatIsWrongWithThem) {
  VPS_SHARED_FILE_OR_SKIP(meshes, "meshes");
  const TemporaryFolder folder;
  const auto file = [&](const char* name) { return (meshes / name).string(); };
  const std::pair<const char*, const char*> bad[] = {
      {"bearing.stl", "if the holes are filled"},       {"open_cube_insideout.off", "hollow with thin walls"},
      {"half_tunnel.off", "the mesh is open"},          {"triangle_soup.stl", "the mesh is open"},
      {"concave_polygon.obj", "concave_polygon.obj: "}, {"invalid/empty.ply", "the file is empty"},
      {"invalid/points_only.ply", "no triangles"},      {"invalid/malformed_index.obj", "malformed"},
  };
  for (const auto& [name, why] : bad) expect_refusal(folder, file(name) + " --resolution 60 -o a.vps.hdf", 3, why);
}

}  // namespace
}  // namespace vps::test

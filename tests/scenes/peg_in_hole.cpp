// SPDX-License-Identifier: GPL-3.0-or-later
// A peg falls into a hole 0.06 to 0.1 mm wider on every side. It enters off-centre and tilted, and comes to rest on the
// ground below.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/scenes/scene.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kSteel = 7800;  // [kg/m^3]
constexpr double kStep = 0.001;  // [s]

struct Fit {
  std::string peg, hole;
  double clearance = 0;    // on every side. [m]
  double hole_height = 0;  // [m]
  double voxel = 0;        // [m]
};

Fit fit_of(const std::string& variant) {
  const std::string folder = "scenes/factory/mesh/factory_insertion/";
  if (variant == "sample") return {sample_mesh("peg.obj"), sample_mesh("hole.obj"), 0.0001, 0.02, 0.0001};
  if (variant == "round") {
    return {shared_file(folder + "factory_round_peg_8mm_loose.obj"),
            shared_file(folder + "factory_round_hole_8mm_subdiv_3x.obj"), 0.000057, 0.0089916, 0.0001};
  }
  return {shared_file(folder + "factory_rectangular_peg_8mm_loose_subdiv_3x.obj"),
          shared_file(folder + "factory_rectangular_hole_8mm_subdiv_3x.obj"), 0.00009, 0.0089916, 0.0001};
}

int scene(const Options& options) {
  const Fit fit = fit_of(options.variant);
  Part peg = bake_part(fit.peg, fit.voxel);
  Part hole = bake_part(fit.hole, fit.voxel);
  if (options.hulls) {
    use_hacd(peg, 4);
    use_hacd(hole, 16);
  }
  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(5);
  run.add(hole, 0, btTransform::getIdentity());
  run.add_box({btScalar(0.05), btScalar(0.05), btScalar(0.005)}, {0, 0, btScalar(-0.005)}, Run::Look::shown);
  // Shifted by half the clearance and tilted by 0.4 degrees.
  constexpr double kTilt = 0.007;  // [rad]
  const btTransform at(btQuaternion({0, 1, 0}, btScalar(kTilt)),
                       {btScalar(fit.clearance / 2), 0, btScalar(fit.hole_height + 0.001)});
  btRigidBody& body = run.add(peg, kSteel, at);
  for (const auto& b : world.bodies) b->setFriction(btScalar(std::sqrt(0.2)));
  double z = 0;
  while (run.time() < 1.0) {
    run.step();
    z = double(peg.baked->mesh_pose(body.getWorldTransform()).getOrigin().z());
  }
  run.print("peg in hole, " + options.variant);
  const double voxel = fit.voxel;
  fmt::print("  its end came to rest {:.4f} mm above the ground, {:.2f} mm/s\n", 1000 * z, 1000 * run.fastest());
  Verdict verdict;
  verdict.expect(std::abs(z) < voxel, "the peg stands on the ground below the hole, within a voxel");
  verdict.expect(run.fastest() < 0.001, "it rests: less than 1 mm/s");
  verdict.expect(run.deepest().in_parts < voxel / 2, "no point is deeper than half a voxel");
  verdict.expect(run.energy_gain() < 1e-7, "energy never exceeds what it started with");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> factory = {"scenes/factory"};
  return run_scene(argc, argv, {{"sample", {}}, {"round", factory}, {"rectangular", factory}}, scene);
}

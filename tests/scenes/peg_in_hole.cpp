// SPDX-License-Identifier: GPL-3.0-or-later
// A peg falls into a hole 0.06 to 0.1 mm wider on every side. It enters off-centre and tilted, and comes to rest on the
// ground below.
#include <fmt/format.h>

#include <cmath>

#include "tests/scenes/assemblies.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kStep = 0.001;  // [s]

int scene(const Options& options) {
  Fit fit = make_fit(options.variant);
  if (options.hulls) {
    use_hacd(fit.peg, 4);
    use_hacd(fit.hole, 16);
  }
  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(5);
  btRigidBody& body = place(run, fit);
  double z = 0;
  while (run.time() < 1.0) {
    run.step();
    z = double(fit.peg.baked->mesh_pose(body.getWorldTransform()).getOrigin().z());
  }
  run.print("peg in hole, " + options.variant);
  const double voxel = fit.peg.baked->asset().info().voxel_size;
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

// SPDX-License-Identifier: GPL-3.0-or-later
// Bunnies fall into a box and come to rest in a heap: all move, all are concave.
#include <fmt/format.h>

#include <algorithm>

#include "tests/scenes/assemblies.h"

namespace {

using namespace vps;
using namespace vps::scenes;

// At 240 Hz the fall is over 20 mm per step. Bodies that penetrate each other so deeply do not separate under a load.
constexpr double kStep = 0.001;  // [s]
// With Bullet's 10, falling bodies press others up to 33 mm into each other, and some stay there.
constexpr int kIterations = 30;

int scene(const Options& options) {
  const bool torus = options.variant == "tori";
  Part part =
      torus ? bake_part(sample_mesh("torus.obj"), 0.002) : bake_part(shared_file("meshes/bunny_3k5.off"), 0.002);
  if (options.hulls) use_hacd(part, 8);

  test::World world;
  world.world.getSolverInfo().m_numIterations = kIterations;
  Run run(world, kStep, options);
  run.measure_depth_every(200);
  run.frame_every(50);
  place(run, torus ? Heap{2, 5} : Heap{5, 8}, part);
  const double seconds = torus ? 2 : 4;
  while (run.time() < seconds) run.step();
  double lowest = 1e9;
  for (const auto& body : world.bodies)
    if (!body->isStaticObject()) lowest = std::min(lowest, double(body->getWorldTransform().getOrigin().z()));
  run.print("heap, " + options.variant);
  const Run::Depth depth = run.depth_now();
  fmt::print("  kinetic energy {:.2g} J, fastest {:.2f} mm/s, at last {:.3f} / {:.3f} mm deep\n", run.kinetic(),
             1000 * run.fastest(), 1000 * depth.in_parts, 1000 * depth.in_boxes);
  Verdict verdict;
  verdict.expect(run.fastest() < (torus ? 0.1 : 0.3), "the heap rests but for jitter");
  verdict.expect(lowest > 0, "none fell through the floor");
  if (torus)
    verdict.expect(depth.in_parts < part.baked->asset().info().voxel_size,
                   "no point is deeper than a voxel in the end");
  verdict.expect(run.energy_gain() < 1e-3, "energy never exceeds what it started with by more than a millijoule");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  return run_scene(argc, argv, {{"tori", {}}, {"bunnies", {"meshes/bunny_3k5.off"}}}, scene);
}

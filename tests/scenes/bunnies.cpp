// SPDX-License-Identifier: GPL-3.0-or-later
// Bunnies fall into a box and come to rest in a heap: all move, all are concave.
#include <fmt/format.h>

#include <cmath>

#include "sample_meshes/shapes.h"
#include "tests/scenes/scene.h"
#include "tests/support/random.h"

namespace {

using namespace vps;
using namespace vps::scenes;

// At 240 Hz the fall is 15 mm per step. Bodies that penetrate each other so deeply do not separate under a load.
constexpr double kStep = 0.001;  // [s]

int scene(const Options& options) {
  const bool torus = options.variant == "tori";
  Part part =
      torus ? bake_part(sample_mesh("torus.obj"), 0.002) : bake_part(shared_file("meshes/bunny_3k5.off"), 0.002);
  const int across = torus ? 2 : 5;
  const int layers = torus ? 5 : 8;
  if (options.hulls) use_hacd(part, 8);
  const AssetInfo& info = part.baked->asset().info();
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) size = std::max(size, info.bounds_max[axis] - info.bounds_min[axis]);

  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(200);
  run.frame_every(50);
  const double half = 0.55 * size * across;
  const double wall = size;
  run.add_box({btScalar(half + 2 * wall), btScalar(half + 2 * wall), btScalar(wall)}, {0, 0, btScalar(-wall)},
              Run::Look::shown);
  for (const double side : {-half - wall, half + wall}) {
    run.add_box({btScalar(wall), btScalar(half + 2 * wall), btScalar(20 * size)},
                {btScalar(side), 0, btScalar(20 * size)}, Run::Look::hidden);
    run.add_box({btScalar(half + 2 * wall), btScalar(wall), btScalar(20 * size)},
                {0, btScalar(side), btScalar(20 * size)}, Run::Look::hidden);
  }
  test::Random random;
  for (int layer = 0; layer < layers; ++layer) {
    for (int i = 0; i < across * across; ++i) {
      const std::array<double, 9> r = random.rotation();
      btTransform at;
      at.setBasis({btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]), btScalar(r[5]),
                   btScalar(r[6]), btScalar(r[7]), btScalar(r[8])});
      const double spacing = 2 * half / across;
      const btVector3 centre(btScalar((i % across + 0.5) * spacing - half),
                             btScalar((i / across + 0.5) * spacing - half), btScalar((layer + 0.7) * 1.2 * size));
      at.setOrigin(centre - at.getBasis() * part.baked->centre_of_mass());
      run.add_mass(part, 1, at);
    }
  }
  for (const auto& body : world.bodies) body->setFriction(btScalar(0.7));
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
  if (torus) verdict.expect(depth.in_parts < info.voxel_size, "no point is deeper than a voxel in the end");
  verdict.expect(run.energy_gain() < 1e-3, "energy never exceeds what it started with by more than a millijoule");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  return run_scene(argc, argv, {{"tori", {}}, {"bunnies", {"meshes/bunny_3k5.off"}}}, scene);
}

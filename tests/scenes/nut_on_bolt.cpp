// SPDX-License-Identifier: GPL-3.0-or-later
// A nut turns down a fixed bolt without friction, by gravity alone or with a torque, and does not leave the helix.
#include <fmt/format.h>

#include <cmath>

#include "tests/scenes/assemblies.h"

namespace {

using namespace vps;
using namespace vps::scenes;

int scene(const Options& options) {
  Thread thread = make_thread(options.variant);
  constexpr double kStep = 0.001;
  if (options.hulls) {
    for (Part* part : {&thread.bolt, &thread.nut}) use_hacd(*part, 16);
  }
  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(5);
  run.frame_every(10);
  btRigidBody& nut = place(run, thread);

  const double per_metre = thread.turn_per_metre();
  const double mass = 1 / double(nut.getInvMass());
  const double torque = thread.torque_on(nut);
  const double inertia = double(nut.getLocalInertia().z()) * per_metre * per_metre;
  const double acceleration = (mass * kGravity - torque * per_metre) / (mass + inertia);
  const double start = double(nut.getWorldTransform().getOrigin().z());
  double turned = 0, off_helix = 0, descent = 0;
  btMatrix3x3 last = nut.getWorldTransform().getBasis();
  while (run.time() < thread.seconds) {
    nut.applyTorque({0, 0, btScalar(torque)});
    run.step();
    const btMatrix3x3& basis = nut.getWorldTransform().getBasis();
    const btMatrix3x3 turn = basis.timesTranspose(last);
    const double angle = std::atan2(double(turn[1][0] - turn[0][1]), double(turn[0][0] + turn[1][1]));
    last = basis;
    turned += angle;
    run.add_work(torque * angle);
    descent = start - double(nut.getWorldTransform().getOrigin().z());
    off_helix = std::max(off_helix, std::abs(descent + turned / per_metre));
  }
  run.print("nut on bolt, " + options.variant);
  const double free = acceleration * thread.seconds * thread.seconds / 2;
  fmt::print("  turned {:.2f} rad, descended {:.3f} mm; off the helix by {:.4f} mm at most, the play is {:.4f} mm\n",
             turned, 1000 * descent, 1000 * off_helix, 1000 * thread.play);
  fmt::print("  without friction it would have descended {:.3f} mm\n", 1000 * free);

  const double voxel = thread.nut.baked->asset().info().voxel_size;
  Verdict verdict;
  verdict.expect(off_helix < thread.play + voxel / 10,
                 "descent is angle / 2 pi * pitch within the play and a tenth of a voxel");
  verdict.expect(descent > thread.slowest * free && descent < free + 2 * thread.play,
                 fmt::format("the nut descends, by more than {} of the frictionless fall and no more than all of it",
                             thread.slowest));
  verdict.expect(run.deepest().in_parts < voxel / 2, "no point is deeper than half a voxel");
  verdict.expect(run.energy_gain() < 0.01 * mass * kGravity * thread.pitch,
                 "energy never exceeds what was put in by 1 % of what a turn releases");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  return run_scene(argc, argv, {{"fine", {}}, {"sample", {}}, {"factory", {"scenes/factory"}}}, scene);
}

// SPDX-License-Identifier: GPL-3.0-or-later
// A nut turns down a fixed bolt without friction, by gravity alone or with a torque, and does not leave the helix.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "sample_meshes/shapes.h"
#include "tests/scenes/scene.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kSteel = 7800;  // [kg/m^3]
constexpr double kGravity = 9.81;

struct Thread {
  Part bolt, nut;
  double pitch = 0;   // [m]
  double play = 0;    // along the axis, from the middle to either flank. [m]
  double lift = 0;    // start of the nut above its position in the file, whole turns. [m]
  double torque = 0;  // about z, relative to gravity's torque through the helix
  double seconds = 0;
  double slowest = 0;  // least part of the frictionless descent
};

// The sample thread with a vertex every 2.5 degrees. With a vertex every 10 degrees, as in the files, the facets lock:
// within one degree the nut must rise by 5.4 um, while the helix sinks by 4.2 um.
enum class Side { bolt, nut };
TriangleMesh fine_thread(Side side) {
  using namespace samples;
  constexpr std::uint32_t kRound = 144, kRows = 32;  // vertices around, rows per pitch
  const Outline hexagon = polygon(6, 0.008);
  std::vector<Ring> rings;
  const auto add = [&](std::uint32_t row, double clearance) {
    const double z = kM10.pitch * row / kRows;
    rings.push_back(make_ring(kRound, z, kM10.at(z, clearance)));
  };
  if (side == Side::bolt) {
    rings = {make_ring(kRound, -0.0064, hexagon), make_ring(kRound, 0, hexagon)};
    for (std::uint32_t row = 0; row <= 10 * kRows; ++row) add(row, 0);
    return make_skin(rings, false);
  }
  rings = {make_ring(kRound, 2 * kM10.pitch, hexagon), make_ring(kRound, 7 * kM10.pitch, hexagon)};
  for (std::uint32_t row = 7 * kRows + 1; row-- > 2 * kRows;) add(row, kThreadClearance);
  return make_skin(rings, true);
}

Thread make_thread(const Options& options) {
  Thread thread;
  if (options.variant == "factory") {
    const std::string folder = "scenes/factory/mesh/factory_nut_bolt/";
    thread.bolt = bake_part(shared_file(folder + "factory_bolt_m16_loose.obj"), 0.0002);
    thread.nut = bake_part(shared_file(folder + "factory_nut_m16_loose_subdiv_3x.obj"), 0.0002);
    thread.pitch = 0.002;
    thread.play = 0.0001155;  // groove 0.831 mm wide where the ridge is 0.6 mm wide
    thread.lift = 0.008;
    thread.seconds = 1.0;
    thread.slowest = 0.3;
    return thread;
  }
  thread.pitch = samples::kM10.pitch;
  thread.play = samples::kThreadClearance * samples::kM10.pitch / 2 / samples::kM10.depth;
  thread.lift = 3 * thread.pitch;
  if (options.variant == "fine") {
    thread.bolt = bake_part(fine_thread(Side::bolt), 0.00015);
    thread.nut = bake_part(fine_thread(Side::nut), 0.00015);
    thread.seconds = 0.8;
    thread.slowest = 0.5;
  } else {
    thread.bolt = bake_part(sample_mesh("bolt.obj"), 0.00015);
    thread.nut = bake_part(sample_mesh("nut.obj"), 0.00015);
    thread.torque = -2;
    thread.seconds = 0.5;
    thread.slowest = 0.3;
  }
  return thread;
}

int scene(const Options& options) {
  Thread thread = make_thread(options);
  constexpr double kStep = 0.001;
  // Four contact points cannot hold a ring in a thread: it rattles.
  for (Part* part : {&thread.bolt, &thread.nut}) {
    part->baked->set_segments(15);
    if (options.hulls) use_hacd(*part, 16);
  }
  test::World world;
  Run run(world, kStep, options);
  run.measure_depth_every(5);
  run.add(thread.bolt, 0, btTransform::getIdentity());
  btRigidBody& nut =
      run.add(thread.nut, kSteel, btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(thread.lift)}));
  for (const auto& body : world.bodies) body->setFriction(0);

  const double per_metre = 2 * std::numbers::pi / thread.pitch;  // [rad/m]
  const double mass = 1 / double(nut.getInvMass());
  const double torque = thread.torque * mass * kGravity / per_metre;
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

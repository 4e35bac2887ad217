// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/scenes/assemblies.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sample_meshes/shapes.h"
#include "tests/support/random.h"

namespace vps::scenes {
namespace {

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

Thread make_parts(const std::string& variant) {
  Thread thread;
  if (variant == "factory") {
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
  if (variant == "fine") {
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

}  // namespace

double Thread::turn_per_metre() const {
  return 2 * std::numbers::pi / pitch;
}
double Thread::torque_on(const btRigidBody& nut_body) const {
  return torque / double(nut_body.getInvMass()) * kGravity / turn_per_metre();
}

Thread make_thread(const std::string& variant) {
  Thread thread = make_parts(variant);
  // Four contact points cannot hold a ring in a thread: it rattles.
  for (Part* part : {&thread.bolt, &thread.nut}) part->baked->set_segments(15);
  return thread;
}

btRigidBody& place(Run& run, const Thread& thread, double turn) {
  run.add(thread.bolt, 0, btTransform::getIdentity()).setFriction(0);
  const btTransform lifted(btQuaternion({0, 0, 1}, btScalar(turn)),
                           {0, 0, btScalar(thread.lift + turn / thread.turn_per_metre())});
  btRigidBody& nut = run.add(thread.nut, kSteel, lifted);
  nut.setFriction(0);
  return nut;
}

Fit make_fit(const std::string& variant) {
  constexpr double kVoxel = 0.0001;  // [m]
  const std::string folder = "scenes/factory/mesh/factory_insertion/";
  const auto fit = [&](const std::filesystem::path& peg, const std::filesystem::path& hole, double clearance,
                       double height) {
    return Fit{bake_part(peg, kVoxel), bake_part(hole, kVoxel), clearance, height};
  };
  if (variant == "sample") return fit(sample_mesh("peg.obj"), sample_mesh("hole.obj"), 0.0001, 0.02);
  if (variant == "round") {
    return fit(shared_file(folder + "factory_round_peg_8mm_loose.obj"),
               shared_file(folder + "factory_round_hole_8mm_subdiv_3x.obj"), 0.000057, 0.0089916);
  }
  return fit(shared_file(folder + "factory_rectangular_peg_8mm_loose_subdiv_3x.obj"),
             shared_file(folder + "factory_rectangular_hole_8mm_subdiv_3x.obj"), 0.00009, 0.0089916);
}

btRigidBody& place(Run& run, const Fit& fit, double direction) {
  const auto friction = btScalar(std::sqrt(0.2));
  run.add(fit.hole, 0, btTransform::getIdentity()).setFriction(friction);
  run.add_box({btScalar(0.05), btScalar(0.05), btScalar(0.005)}, {0, 0, btScalar(-0.005)}, Run::Look::shown)
      .setFriction(friction);
  // Shifted by half the clearance and tilted by 0.4 degrees.
  constexpr double kTilt = 0.007;  // [rad]
  const double shift = fit.clearance / 2;
  const auto x = btScalar(std::cos(direction));
  const auto y = btScalar(std::sin(direction));
  const btTransform at(btQuaternion({-y, x, 0}, btScalar(kTilt)),
                       {btScalar(shift) * x, btScalar(shift) * y, btScalar(fit.hole_height + 0.001)});
  btRigidBody& peg = run.add(fit.peg, kSteel, at);
  peg.setFriction(friction);
  return peg;
}

std::array<double, 2> Train::torques(const btRigidBody& driven_body) const {
  const double brake = kTorque / (ratio * ratio * kSpeed);  // [N m s]
  return {kTorque, -brake * double(driven_body.getAngularVelocity().z())};
}

Train make_train(const std::string& variant) {
  Train train;
  if (variant == "sample") {
    train.driver = bake_part(sample_mesh("gear.obj"), 0.00025);
    train.driven = bake_part(sample_mesh("gear.obj"), 0.00025);
    // Rotated by half a tooth, with 41 mm between the axes. At 40 mm, twice the pitch radius, the outlines of the
    // straight flanks overlap in every position. From 40.3 mm on the gears turn; at 41 mm the lag is 0.9 to 1.6
    // degrees.
    train.driven_at = btTransform(btQuaternion({0, 0, 1}, btScalar(std::numbers::pi / 20)), {btScalar(0.041), 0, 0});
    train.backlash = 0.028;
  } else {
    // The files hold the gears in place on their base.
    const std::string folder = "scenes/factory/mesh/factory_gears/";
    train.driver = bake_part(shared_file(folder + "factory_gear_small_space_5e-4.obj"), 0.00025);
    train.driven = bake_part(shared_file(folder + "factory_gear_medium_space_5e-4.obj"), 0.00025);
    train.ratio = 0.5;
    train.backlash = 0.016;
  }
  return train;
}

namespace {

// A part turned about the parallel to z through its centre of mass.
btTransform turned(const Part& part, const btTransform& at, double turn) {
  const btVector3 centre = at * part.baked->centre_of_mass();
  const btTransform rotation(btQuaternion({0, 0, 1}, btScalar(turn)));
  return btTransform(btQuaternion::getIdentity(), centre) * rotation *
         btTransform(btQuaternion::getIdentity(), -centre) * at;
}

}  // namespace

HingedTrain::HingedTrain(test::World& world, Run& run, const Train& train, double turn)
    : gears{&run.add(train.driver, kSteel, turned(train.driver, btTransform::getIdentity(), turn)),
            &run.add(train.driven, kSteel, turned(train.driven, train.driven_at, -train.ratio * turn))},
      world_(world) {
  for (std::size_t k : {0U, 1U}) {
    gears[k]->setFriction(0);
    hinges_[k] = std::make_unique<btHingeConstraint>(*gears[k], btVector3(0, 0, 0), btVector3(0, 0, 1));
    world_.world.addConstraint(hinges_[k].get());
  }
}
HingedTrain::~HingedTrain() {
  for (const auto& hinge : hinges_) world_.world.removeConstraint(hinge.get());
}

namespace {

// Radius of a sphere about the centre of mass that holds the part, however it turns. [m]
double reach_of(const Part& part) {
  const PointshellView& shell = part.baked->pointshell();
  double reach = 0;
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    reach = std::max(reach, double((btVector3(p.x, p.y, p.z) - part.baked->centre_of_mass()).length()));
  }
  return reach + double{shell.covering_radius};
}

}  // namespace

void place(Run& run, const Heap& heap, const Part& part) {
  constexpr auto kFriction = btScalar(0.7);
  const AssetInfo& info = part.baked->asset().info();
  double size = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) size = std::max(size, info.bounds_max[axis] - info.bounds_min[axis]);
  const double spacing = 2 * reach_of(part);
  const double half = spacing * heap.across / 2;
  const double wall = size;
  const auto add_box = [&](const btVector3& half_extents, const btVector3& at, Run::Look look) {
    run.add_box(half_extents, at, look).setFriction(kFriction);
  };
  add_box({btScalar(half + 2 * wall), btScalar(half + 2 * wall), btScalar(wall)}, {0, 0, btScalar(-wall)},
          Run::Look::shown);
  for (const double side : {-half - wall, half + wall}) {
    add_box({btScalar(wall), btScalar(half + 2 * wall), btScalar(20 * size)}, {btScalar(side), 0, btScalar(20 * size)},
            Run::Look::hidden);
    add_box({btScalar(half + 2 * wall), btScalar(wall), btScalar(20 * size)}, {0, btScalar(side), btScalar(20 * size)},
            Run::Look::hidden);
  }
  test::Random random(heap.seed);
  for (int layer = 0; layer < heap.layers; ++layer) {
    for (int i = 0; i < heap.across * heap.across; ++i) {
      const int row = i / heap.across;
      const std::array<double, 9> r = random.rotation();
      btTransform at;
      at.setBasis({btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]), btScalar(r[5]),
                   btScalar(r[6]), btScalar(r[7]), btScalar(r[8])});
      const btVector3 centre(btScalar((i % heap.across + 0.5) * spacing - half), btScalar((row + 0.5) * spacing - half),
                             btScalar((layer + 0.5) * spacing));
      at.setOrigin(centre - at.getBasis() * part.baked->centre_of_mass());
      run.add_mass(part, 1, at).setFriction(kFriction);
    }
  }
}

}  // namespace vps::scenes

// SPDX-License-Identifier: GPL-3.0-or-later
// Two gears on hinges, without friction: a torque drives one, a brake in proportion to its speed holds the other.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/scenes/scene.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kSteel = 7800;   // [kg/m^3]
constexpr double kStep = 0.001;   // [s]
constexpr double kTorque = 0.01;  // on the driver. [N m]
constexpr double kSpeed = 5;      // steady speed of the driver under the brake. [rad/s]

struct Train {
  Part driver, driven;
  btTransform driven_at = btTransform::getIdentity();
  double ratio = 1;     // of the driven gear's speed to the driver's, from the numbers of teeth
  double backlash = 0;  // largest lag of the driven gear at this distance of the axes. [rad]
};

Train make_train(const Options& options) {
  Train train;
  if (options.variant == "sample") {
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

double angle_about_z(const btMatrix3x3& now, const btMatrix3x3& before) {
  const btMatrix3x3 turn = now.timesTranspose(before);
  return std::atan2(double(turn[1][0] - turn[0][1]), double(turn[0][0] + turn[1][1]));
}

int scene(const Options& options) {
  Train train = make_train(options);
  if (options.hulls) {
    for (Part* part : {&train.driver, &train.driven}) use_hacd(*part, 24);
  }
  test::World world;
  Run run(world, kStep, options);
  btRigidBody* const gears[] = {&run.add(train.driver, kSteel, btTransform::getIdentity()),
                                &run.add(train.driven, kSteel, train.driven_at)};
  std::vector<std::unique_ptr<btHingeConstraint>> hinges;
  for (btRigidBody* gear : gears) {
    gear->setFriction(0);
    hinges.push_back(std::make_unique<btHingeConstraint>(*gear, btVector3(0, 0, 0), btVector3(0, 0, 1)));
    world.world.addConstraint(hinges.back().get());
  }
  const double brake = kTorque / (train.ratio * train.ratio * kSpeed);  // [N m s]
  double turned[2] = {}, driven_work = 0, braked_work = 0, lag = 0, settled = 0;
  constexpr double kSettle = 0.2, kEnd = 0.8;  // [s]
  while (run.time() < kEnd) {
    const double torques[2] = {kTorque, -brake * double(gears[1]->getAngularVelocity().z())};
    const btMatrix3x3 before[2] = {gears[0]->getWorldTransform().getBasis(), gears[1]->getWorldTransform().getBasis()};
    for (int k : {0, 1}) gears[k]->applyTorque({0, 0, btScalar(torques[k])});
    run.step();
    double angles[2];
    for (int k : {0, 1}) turned[k] += angles[k] = angle_about_z(gears[k]->getWorldTransform().getBasis(), before[k]);
    driven_work += torques[0] * angles[0];
    braked_work -= torques[1] * angles[1];
    run.add_work(torques[0] * angles[0] + torques[1] * angles[1]);
    lag = std::max(lag, std::abs(turned[0] * train.ratio + turned[1]));
    if (run.time() < kSettle) settled = turned[0];
  }
  const double speed = (turned[0] - settled) / (kEnd - kSettle);
  run.print("gears, " + options.variant);
  fmt::print("  turned {:.3f} and {:.3f} rad, lag at most {:.4f} rad; {:.3f} of the work put in reached the brake\n",
             turned[0], turned[1], lag, braked_work / driven_work);
  fmt::print("  driver {:.2f} rad/s, {:.2f} rad/s without losses\n", speed, kSpeed);
  for (const auto& hinge : hinges) world.world.removeConstraint(hinge.get());

  const double voxel = train.driver.baked->asset().info().voxel_size;
  Verdict verdict;
  verdict.expect(lag < 1.1 * train.backlash, "the driven gear follows by the ratio of teeth, within the backlash");
  verdict.expect(std::abs(speed - kSpeed) < 0.15 * kSpeed,
                 "the driver turns as fast as the brake lets it, within 15 %");
  verdict.expect(braked_work > 0.9 * driven_work, "nine tenths of the work reach the brake");
  verdict.expect(run.deepest().in_parts < voxel / 2, "no point is deeper than half a voxel");
  // At the start the gears cross the backlash and collide; then Bullet's explicit brake makes the energy swing by this
  // much.
  verdict.expect(run.energy_gain() < 0.01 * driven_work, "energy never exceeds what was put in by 1 % of the work");
  return verdict.exit_code();
}

}  // namespace

int main(int argc, char** argv) {
  return run_scene(argc, argv, {{"sample", {}}, {"factory", {"scenes/factory"}}}, scene);
}

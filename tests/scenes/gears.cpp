// SPDX-License-Identifier: GPL-3.0-or-later
// Two gears on hinges, without friction: a torque drives one, a brake in proportion to its speed holds the other.
#include <fmt/format.h>

#include <cmath>

#include "tests/scenes/assemblies.h"

namespace {

using namespace vps;
using namespace vps::scenes;

constexpr double kStep = 0.001;  // [s]

double angle_about_z(const btMatrix3x3& now, const btMatrix3x3& before) {
  const btMatrix3x3 turn = now.timesTranspose(before);
  return std::atan2(double(turn[1][0] - turn[0][1]), double(turn[0][0] + turn[1][1]));
}

int scene(const Options& options) {
  Train train = make_train(options.variant);
  if (options.hulls) {
    for (Part* part : {&train.driver, &train.driven}) use_hacd(*part, 24);
  }
  test::World world;
  Run run(world, kStep, options);
  const HingedTrain hinged(world, run, train);
  const auto& gears = hinged.gears;
  double turned[2] = {}, driven_work = 0, braked_work = 0, lag = 0, settled = 0;
  constexpr double kSettle = 0.2, kEnd = 0.8;  // [s]
  while (run.time() < kEnd) {
    const std::array<double, 2> torques = train.torques(*gears[1]);
    const btMatrix3x3 before[2] = {gears[0]->getWorldTransform().getBasis(), gears[1]->getWorldTransform().getBasis()};
    for (std::size_t k : {0U, 1U}) gears[k]->applyTorque({0, 0, btScalar(torques[k])});
    run.step();
    double angles[2];
    for (std::size_t k : {0U, 1U})
      turned[k] += angles[k] = angle_about_z(gears[k]->getWorldTransform().getBasis(), before[k]);
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
  fmt::print("  driver {:.2f} rad/s, {:.2f} rad/s without losses\n", speed, Train::kSpeed);

  const double voxel = train.driver.baked->asset().info().voxel_size;
  Verdict verdict;
  verdict.expect(lag < 1.1 * train.backlash, "the driven gear follows by the ratio of teeth, within the backlash");
  verdict.expect(std::abs(speed - Train::kSpeed) < 0.15 * Train::kSpeed,
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

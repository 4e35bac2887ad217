// SPDX-License-Identifier: GPL-3.0-or-later
// How long stacks of balls, cubes and bunnies stand. Paper: Sec. 4.1, last paragraph.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/paper/paper.h"
#include "tests/paper/scene.h"

namespace vps::paper {
namespace {

constexpr double kRate = 200;          // [Hz]
constexpr double kStackDuration = 30;  // [s]
constexpr int kSeeds = 5;
// A body has left the stack when its distance from its place exceeds this part of its height.
constexpr double kFallen = 0.25;

struct StackOptions {
  int bodies = 2;
  double height = 2 * kBallRadius;  ///< of a body. [m]
  double below = kBallRadius;       ///< from a body's centre down. [m]
  double voxel = kCoarseVoxel;      ///< of the baked body. [m]
};

struct Standing {
  double seconds = kStackDuration;  // until the first body left
  double drift = 0;                 // largest distance of a body from its place at the end, if all stayed. [m]
  double mean_us = 0;               // narrowphase of a step
};

Standing stand(const Side& side, const Floor& floor, const StackOptions& options,
               const std::vector<btMatrix3x3>& rotations) {
  Scene scene(floor, side.motion, {10, kRate, options.voxel});
  std::vector<const btRigidBody*> bodies;
  std::vector<btVector3> places;
  for (int i = 0; i < options.bodies; ++i) {
    places.push_back({0, btScalar(options.below + options.height * i), 0});
    bodies.push_back(&scene.add(side.body, btTransform(rotations[std::size_t(i)], places.back())));
  }
  Standing out;
  double us = 0;
  for (int step = 1; step <= int(kStackDuration * kRate); ++step) {
    scene.step();
    us += scene.last_us();
    out.mean_us = us / step;
    out.drift = 0;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const btVector3 moved = bodies[i]->getWorldTransform().getOrigin() - places[i];
      out.drift = std::max(out.drift, double(moved.length()));
    }
    if (out.drift > kFallen * options.height) {
      out.seconds = step / kRate;
      break;
    }
  }
  return out;
}

struct Stack {
  std::string bodies;
  Side side;
  StackOptions options;
  bool turned = false;  // bodies are rotated at random
};

nlohmann::json measure(const Stack& stack, const Floor& floor) {
  const std::vector<btMatrix3x3> random = random_rotations(kSeeds * stack.options.bodies);
  const std::vector<btMatrix3x3> upright(std::size_t(stack.options.bodies), btMatrix3x3::getIdentity());
  std::vector<double> seconds;
  double drift = 0;
  double us = 0;
  for (int seed = 0; seed < (stack.turned ? kSeeds : 1); ++seed) {
    const auto first = random.begin() + std::ptrdiff_t(seed) * stack.options.bodies;
    const Standing one = stand(stack.side, floor, stack.options,
                               stack.turned ? std::vector(first, first + stack.options.bodies) : upright);
    seconds.push_back(one.seconds);
    us = std::max(us, one.mean_us);
    if (one.seconds == kStackDuration) drift = std::max(drift, one.drift);
  }
  return {{"bodies", stack.bodies},
          {"count", stack.options.bodies},
          {"side", stack.side.name},
          {"floor", floor.name},
          {"seconds", seconds},
          {"drift", drift},
          {"mean_us", us}};
}

}  // namespace

nlohmann::json run_stacks(const Balls& balls, const Bunnies& bunnies, const std::vector<Floor>& floors) {
  const btScalar half = btScalar(kBallRadius);
  const AssetInfo& bunny = bunnies.fine.asset->info();
  const double bunny_height = bunny.bounds_max[1] - bunny.bounds_min[1];
  const double bunny_below = bunny.centre_of_mass[1] - bunny.bounds_min[1];
  const Side sphere{"Bullet", {{}, std::make_shared<btSphereShape>(half)}};
  const Side box{"Bullet", {{}, std::make_shared<btBoxShape>(btVector3(half, half, half))}};
  std::vector<Stack> stacks;
  for (const int count : {2, 3, 5}) {
    for (const Side& side : {sphere, ours("ours, low", balls.low), ours("ours, high", balls.high)}) {
      stacks.push_back({"balls", side, {count}, true});
    }
  }
  for (const int count : {3, 10}) {
    for (const Side& side : {box, ours("ours", balls.cube)}) stacks.push_back({"cubes", side, {count}});
  }
  std::vector<Side> bunny_sides = bunnies.hacd;
  bunny_sides.push_back(bunnies.gimpact);
  bunny_sides.push_back(ours("ours, low", bunnies.low));
  bunny_sides.push_back(ours("ours, fine", bunnies.fine));
  for (const Side& side : bunny_sides)
    stacks.push_back({"bunnies", side, {2, bunny_height, bunny_below, bunny.voxel_size}});

  // Only the first floor, for which the contacts of all sides are exact.
  const Floor& floor = floors.front();
  nlohmann::json runs = nlohmann::json::array();
  for (const Stack& stack : stacks) {
    fmt::print(stderr, "paper_runs: {} {}, {}\n", stack.options.bodies, stack.bodies, stack.side.name);
    runs.push_back(measure(stack, floor));
  }
  return {{"runs", runs}, {"duration", kStackDuration}, {"fallen", kFallen}, {"rate", kRate}, {"seeds", kSeeds}};
}

}  // namespace vps::paper

// SPDX-License-Identifier: GPL-3.0-or-later
// Many bodies: bins of bunnies, and stacks of ten cubes.
#include <cmath>
#include <set>

#include "tests/bench/scenes/scenes.h"
#include "tests/scenes/assemblies.h"
#include "tests/support/random.h"

namespace vps::bench {
namespace {

constexpr double kHeapStep = 1.0 / 240;   // [s]
constexpr std::size_t kHeapSecond = 240;  // steps

Side heap_of(const scenes::Heap& heap, double voxel, const BodySide& side) {
  const auto play = [=](int start, Quality* quality) {
    test::World world;
    const scenes::Options none;
    scenes::Run run(world, kHeapStep, none);
    scenes::place(run, {heap.across, heap.layers, std::uint64_t(start) + 1}, *side.part);
    prepare(world, voxel);
    Script script;
    script.step = kHeapStep;
    script.steps = 4 * kHeapSecond;
    script.depth = [&] { return depth_of_all(run); };
    script.depth_every = kHeapSecond / 5;
    return record(world, run, script, quality);
  };
  // HACD takes ten times as long as the others.
  return {side.name, side.kind, voxel, play, side.kind == Kind::hacd ? 1 : 3};
}

// How a heap settles is chance: one that stays restless takes 1.4 times as long as the next.
constexpr int kHeapStarts = 6;

Scene heap_scene(Bodies& bodies, const scenes::Heap& heap, int starts) {
  Scene scene;
  scene.plays = starts;
  const int count = heap.across * heap.across * heap.layers;
  scene.name = "bin of " + std::to_string(count);
  scene.phases = {{"fall and settle", 0, 3 * kHeapSecond}, {"rest", 3 * kHeapSecond, 4 * kHeapSecond}};
  scene.sides = [=, &bodies] {
    const Body& bunny = bodies.get("bunny");
    std::vector<Side> sides;
    std::set<Kind> others;
    for (const BodySide& side : bunny.sides) {
      if (side.kind != Kind::baked && !others.insert(side.kind).second) continue;  // one of a kind suffices
      sides.push_back(heap_of(heap, bunny.voxel, side));
    }
    return sides;
  };
  return scene;
}

constexpr int kStackStarts = 8;

struct StackSetting {
  int iterations = 0;
  bool has_own_threshold = true;  // split impulses from two voxels on; else from Bullet's default on, 40 mm
};

// Each start shifts every cube by up to 2 % of its side and turns it by up to 0.03 rad.
Side stack_of(const Body& body, const BodySide& side, StackSetting setting) {
  const double mass = body.mass, voxel = body.voxel;
  const auto play = [=](int start, Quality* quality) {
    constexpr double kSide = 0.02;  // of a cube. [m]
    test::World world;
    const scenes::Options none;
    scenes::Run run(world, kHeapStep, none);
    run.add_box({btScalar(0.5), btScalar(0.5), btScalar(0.05)}, {0, 0, btScalar(-0.05)}, scenes::Run::Look::shown);
    test::Random random(std::uint64_t(start) + 1);
    for (int i = 0; i < 10; ++i) {
      const btQuaternion turn({0, 0, 1}, btScalar(random.between(-0.03, 0.03)));
      const double x = random.between(-0.02, 0.02) * kSide, y = random.between(-0.02, 0.02) * kSide;
      run.add_mass(*side.part, mass, btTransform(turn, {btScalar(x), btScalar(y), btScalar((i + 0.5) * kSide)}));
    }
    prepare(world, voxel);
    btContactSolverInfo& solver = world.world.getSolverInfo();
    solver.m_numIterations = setting.iterations;
    if (!setting.has_own_threshold) {
      solver.m_splitImpulsePenetrationThreshold = btContactSolverInfo().m_splitImpulsePenetrationThreshold;
    }
    Script script;
    script.step = kHeapStep;
    script.steps = 3 * kHeapSecond;
    script.depth = [&] { return depth_of_all(run); };
    script.depth_every = 12;
    script.fallen = kSide / 4;
    return record(world, run, script, quality);
  };
  return {side.name, side.kind, voxel, play, 2};
}

Scene stack_scene(Bodies& bodies, StackSetting setting) {
  Scene stack;
  stack.name = "ten cubes, " + std::to_string(setting.iterations) + " iterations";
  if (!setting.has_own_threshold) stack.name += ", Bullet's threshold";
  stack.plays = kStackStarts;
  stack.phases = {{"stand", 0, 3 * kHeapSecond}};
  stack.sides = [=, &bodies] {
    std::vector<Side> sides;
    const Body &fine = bodies.get("cube"), &coarse = bodies.get("coarse cube");
    sides.push_back(stack_of(coarse, coarse.sides[0], setting));
    for (const BodySide& side : fine.sides) sides.push_back(stack_of(fine, side, setting));
    return sides;
  };
  return stack;
}

}  // namespace

std::vector<Scene> heap_scenes(Bodies& bodies) {
  const bool is_full = bodies.options().length == Length::full;
  std::vector<Scene> scenes = {heap_scene(bodies, {3, 3}, is_full ? kHeapStarts : 1)};
  if (is_full) scenes.push_back(heap_scene(bodies, {5, 4}, 1));
  for (const bool own : {true, false}) {
    for (const int iterations : {10, 50}) scenes.push_back(stack_scene(bodies, {iterations, own}));
  }
  return scenes;
}

}  // namespace vps::bench

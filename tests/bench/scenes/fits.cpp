// SPDX-License-Identifier: GPL-3.0-or-later
// Tight fits of tests/scenes: a nut on its bolt, a peg in its hole, two gears. No convex hull can hold them; HACD
// tries.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/bench/scenes/scenes.h"
#include "tests/scenes/assemblies.h"

namespace vps::bench {
namespace {

constexpr double kFitStep = 0.001;  // [s]
constexpr int kStarts = 12;

// Spread evenly over a full turn; the first is 0. [rad]
double start_turn(int play) {
  constexpr double kGolden = 0.6180339887498949;
  return 2 * std::numbers::pi * std::fmod(kGolden * play, 1.0);
}

enum class Shapes : std::uint8_t { baked, hacd };

double voxel_of(const scenes::Thread& thread) {
  return thread.nut.baked->asset().info().voxel_size;
}
double voxel_of(const scenes::Fit& fit) {
  return fit.peg.baked->asset().info().voxel_size;
}
double voxel_of(const scenes::Train& train) {
  return train.driver.baked->asset().info().voxel_size;
}

Script fit_script(const scenes::Run& run, double seconds) {
  Script script;
  script.step = kFitStep;
  script.steps = std::size_t(std::lround(seconds / kFitStep));
  script.depth = [&run] { return depth_of_all(run); };
  script.depth_every = 5;
  return script;
}

std::vector<double> play_thread(const scenes::Thread& thread, int play, Quality* quality) {
  test::World world;
  const scenes::Options none;
  scenes::Run run(world, kFitStep, none);
  btRigidBody& nut = place(run, thread, start_turn(play));
  prepare(world, voxel_of(thread));
  const double torque = thread.torque_on(nut);
  Script script = fit_script(run, thread.seconds);
  script.drive = [&] { nut.applyTorque({0, 0, btScalar(torque)}); };
  script.power = [&] { return torque * double(nut.getAngularVelocity().z()); };
  return record(world, run, script, quality);
}

std::vector<double> play_fit(const scenes::Fit& fit, int play, Quality* quality) {
  test::World world;
  const scenes::Options none;
  scenes::Run run(world, kFitStep, none);
  place(run, fit, start_turn(play));
  prepare(world, voxel_of(fit));
  return record(world, run, fit_script(run, 2), quality);
}

std::vector<double> play_train(const scenes::Train& train, int play, Quality* quality) {
  test::World world;
  const scenes::Options none;
  scenes::Run run(world, kFitStep, none);
  const scenes::HingedTrain hinged(world, run, train, start_turn(play));
  prepare(world, voxel_of(train));
  std::array<double, 2> torques{};
  Script script = fit_script(run, 0.8);
  script.drive = [&] {
    torques = train.torques(*hinged.gears[1]);
    for (std::size_t k : {0U, 1U}) hinged.gears[k]->applyTorque({0, 0, btScalar(torques[k])});
  };
  script.power = [&] {
    double sum = 0;
    for (std::size_t k : {0U, 1U}) sum += torques[k] * double(hinged.gears[k]->getAngularVelocity().z());
    return sum;
  };
  return record(world, run, script, quality);
}

scenes::Thread thread_of(const std::string& variant, Shapes shapes) {
  scenes::Thread thread = scenes::make_thread(variant);
  if (shapes == Shapes::hacd) {
    for (scenes::Part* part : {&thread.bolt, &thread.nut}) use_hacd(*part, 16);
  }
  return thread;
}

scenes::Fit fit_of(const std::string& variant, Shapes shapes) {
  scenes::Fit fit = scenes::make_fit(variant);
  if (shapes == Shapes::hacd) {
    use_hacd(fit.peg, 4);
    use_hacd(fit.hole, 16);
  }
  return fit;
}

scenes::Train train_of(const std::string& variant, Shapes shapes) {
  scenes::Train train = scenes::make_train(variant);
  if (shapes == Shapes::hacd) {
    for (scenes::Part* part : {&train.driver, &train.driven}) use_hacd(*part, 24);
  }
  return train;
}

// @param make  the assembly with the shapes of a side @param play  plays it
template <class Make, class Play>
Scene fit_scene(const std::string& name, const std::string& variant, Hacd hacd, Make make, Play play) {
  Scene scene;
  scene.name = fmt::format("{}, {}", name, variant);
  scene.plays = kStarts;
  scene.phases = {{"all", 0, std::size_t(-1)}};
  scene.sides = [=] {
    std::vector<Side> sides;
    for (const Shapes shapes : {Shapes::baked, Shapes::hacd}) {
      if (shapes == Shapes::hacd && hacd == Hacd::without) continue;
      using Assembly = decltype(make(variant, shapes));
      const auto assembly = std::make_shared<Assembly>(make(variant, shapes));
      const Kind kind = shapes == Shapes::baked ? Kind::baked : Kind::hacd;
      sides.push_back({kind == Kind::baked ? "baked" : "HACD", kind, voxel_of(*assembly),
                       [=](int start, Quality* quality) { return play(*assembly, start, quality); }});
    }
    return sides;
  };
  return scene;
}

}  // namespace

std::vector<Scene> fit_scenes(Hacd hacd) {
  std::vector<Scene> scenes;
  const auto add = [&](const std::string& variant, const std::string& peg_variant) {
    scenes.push_back(fit_scene("nut on bolt", variant, hacd, thread_of, play_thread));
    scenes.push_back(fit_scene("peg in hole", peg_variant, hacd, fit_of, play_fit));
    scenes.push_back(fit_scene("gears", variant, hacd, train_of, play_train));
  };
  add("sample", "sample");
  if (std::filesystem::exists(scenes::shared_file("scenes/factory"))) {
    add("factory", "round");
  } else {
    fmt::print(stderr, "scene_bench: {} is absent: its scenes are left out\n",
               scenes::shared_file("scenes/factory").string());
  }
  return scenes;
}

}  // namespace vps::bench

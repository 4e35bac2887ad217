// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes in stock Bullet, baked and with Bullet's own shapes, all sides in turn in several rounds: times of the
// narrowphase, and what the bodies do. Prints Markdown, worst rows first.
#include <fmt/format.h>
#include <hwy/highway.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <fstream>

#include "cli/lab/statistics.h"
#include "tests/bench/scenes/scenes.h"
#include "tests/bench/scenes/table.h"

namespace vps::bench {
namespace {

struct Options {
  SceneOptions scenes;
  std::string only, json;
  int rounds = 0;  // 0: three, or one if quick
};

struct InstructionSet {
  std::string name;
  std::int64_t target = 0;  // of Highway
};

// The best of this machine, and AVX2 beside AVX-512.
std::vector<InstructionSet> instruction_sets() {
  const std::int64_t supported = hwy::SupportedTargets() & HWY_TARGETS;
  const std::int64_t best = supported & -supported;
  std::vector<InstructionSet> sets = {{hwy::TargetName(best), best}};
  if (best != HWY_AVX2 && (supported & HWY_AVX2) != 0) sets.push_back({hwy::TargetName(HWY_AVX2), HWY_AVX2});
  return sets;
}

// Restores the choice of the machine.
struct Forced {
  explicit Forced(std::int64_t target) { hwy::SetSupportedTargetsForTest(target); }
  ~Forced() { hwy::SetSupportedTargetsForTest(0); }
};

// One side with one instruction set.
struct Contender {
  const Side* side;
  InstructionSet set;
  std::vector<std::vector<std::vector<double>>> us{};  // [play][step][round]
};

void play_round(Contender& contender, int plays) {
  const Forced forced(contender.set.target);
  contender.us.resize(std::size_t(plays));
  for (int play = 0; play < plays; ++play) {
    const std::vector<double> us = contender.side->play(play, nullptr);
    auto& steps = contender.us[std::size_t(play)];
    steps.resize(us.size());
    for (std::size_t i = 0; i < us.size(); ++i) steps[i].push_back(us[i]);
  }
}

// A step's time is the least of its rounds: a play repeats to the bit, and other programs only add time.
StepTimes times_of(const Contender& contender, const Phase& phase) {
  std::vector<double> all, starts;
  for (const auto& steps : contender.us) {
    std::vector<double> us;
    for (std::size_t i = phase.first; i < std::min(phase.last, steps.size()); ++i) {
      us.push_back(*std::min_element(steps[i].begin(), steps[i].end()));
    }
    starts.push_back(lab::percentile(us, 0.5));
    all.insert(all.end(), us.begin(), us.end());
  }
  return {lab::percentile(all, 0.5), lab::percentile(all, 0.99), lab::percentile(all, 1), starts};
}

Quality quality_of(const Side& side, int plays) {
  Quality worst;
  for (int play = 0; play < plays; ++play) {
    Quality quality;
    side.play(play, &quality);
    worst.keep_worse(quality, play);
  }
  return worst;
}

bool is_chosen(const Scene& scene, const std::string& only) {
  return scene.name.find(only) != std::string::npos || only.starts_with(scene.name);
}

void play_scene(const Scene& scene, const Options& options, Table& table) {
  std::vector<Side> sides = scene.sides();
  std::erase_if(
      sides, [&](const Side& side) { return (scene.name + ", " + side.name).find(options.only) == std::string::npos; });
  const std::vector<InstructionSet> sets = instruction_sets();
  std::vector<Contender> contenders;
  for (const Side& side : sides) {
    for (const InstructionSet& set : sets) {
      if (side.kind == Kind::baked || set.target == sets[0].target) contenders.push_back({&side, set});
    }
  }
  // Warms up too.
  for (const Side& side : sides) {
    table.qualities.push_back({scene.name, side.name, side.kind, side.voxel, quality_of(side, scene.plays)});
  }
  for (int round = 1; round <= options.rounds; ++round) {
    fmt::print(stderr, "scene_bench: {}: round {} of {}\n", scene.name, round, options.rounds);
    for (Contender& contender : contenders) {
      if (round <= contender.side->rounds) play_round(contender, scene.plays);
    }
  }
  for (const Phase& phase : scene.phases) {
    for (const Contender& contender : contenders) {
      if (contender.set.target == sets[0].target) {
        table.times.push_back({scene.name, phase.name, contender.side->name, contender.side->kind, {}});
      }
      table.times.back().times.push_back(times_of(contender, phase));
    }
  }
}

void write(const Table& table, const std::string& path) {
  std::ofstream out(path);
  out << table.json().dump(1) << '\n';
  out.close();
  if (!out) throw std::runtime_error(path + ": cannot be written");
}

void run(const Options& options) {
  Bodies bodies(options.scenes);
  std::vector<Scene> scenes;
  for (const auto& some :
       {drop_scenes(bodies), pair_scenes(bodies), heap_scenes(bodies), fit_scenes(options.scenes.hacd)}) {
    scenes.insert(scenes.end(), some.begin(), some.end());
  }
  Table table;
  for (const InstructionSet& set : instruction_sets()) table.sets.push_back(set.name);
  for (const Scene& scene : scenes) {
    if (!is_chosen(scene, options.only)) continue;
    play_scene(scene, options, table);
    if (!options.json.empty()) write(table, options.json);
  }
  fmt::print("{}", table.markdown());
}

}  // namespace
}  // namespace vps::bench

int main(int argc, char** argv) {
  vps::bench::Options options;
  CLI::App app("Scenes in stock Bullet: times of the narrowphase, and what the bodies do");
  app.add_option("mesh", options.scenes.mesh, "The bunny: a closed mesh")->required();
  app.add_option("--scale", options.scenes.scale, "Metres per unit of the mesh");
  app.add_option("--work", options.scenes.work, "Folder for hulls and poses that the next run finds again");
  app.add_option("--only", options.only, "Play only rows whose 'SCENE, SIDE' contains this");
  app.add_option("--rounds", options.rounds, "Measured rounds (default 3)")->check(CLI::PositiveNumber);
  app.add_option("--json", options.json, "Also write the numbers there");
  bool quick = false;
  app.add_flag("--quick", quick, "Four rotations, 40 poses, no bin of 100; one round unless --rounds says otherwise");
  bool no_hacd = false;
  app.add_flag("--without-hacd", no_hacd, "Leave out HACD's hulls, which take minutes once");
  CLI11_PARSE(app, argc, argv);
  if (no_hacd) options.scenes.hacd = vps::bench::Hacd::without;
  if (quick) options.scenes.length = vps::bench::Length::quick;
  if (options.rounds == 0) options.rounds = quick ? 1 : 3;
  try {
    vps::bench::run(options);
    return EXIT_SUCCESS;
  } catch (const std::exception& error) {
    fmt::print(stderr, "scene_bench: error: {}\n", error.what());
    return EXIT_FAILURE;
  }
}

// SPDX-License-Identifier: GPL-3.0-or-later
// A bunny dropped on a plane, without segmentation and by segmentation level. Paper: Sec. 4.2, Figs. 8 and 10, Table 2.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/paper/paper.h"
#include "tests/paper/scene.h"

namespace vps::paper {
namespace {

constexpr int kBunnySteps = 600;
constexpr int kFirstTimed = 200;
constexpr int kRounds = 3;
constexpr std::uint32_t kLevels = 5;

double median(std::vector<double> values) {
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / double(values.size());
}

struct Fall {
  // Per step: narrowphase and whole step [us], [m/s], [J], [m].
  std::vector<double> microseconds, step_us, speed, energy, lowest;
  double creep = 0;  // mean sideways speed in the timed steps. [m/s]
};

Fall fall(const Side& side, const Floor& floor, const std::vector<btVector3>& corners, const btMatrix3x3& rotation) {
  Drop drop(side, floor, corners, rotation, {});
  Fall out;
  btVector3 first(0, 0, 0);
  for (int step = 0; step < kBunnySteps; ++step) {
    if (step == kFirstTimed) first = drop.body().getWorldTransform().getOrigin();
    drop.step();
    out.microseconds.push_back(drop.scene().last_us());
    out.step_us.push_back(drop.scene().last_step_us());
    out.speed.push_back(double(drop.body().getLinearVelocity().length()));
    out.energy.push_back(test::kinetic_energy(drop.body()));
    out.lowest.push_back(drop.lowest());
  }
  const btVector3 moved = drop.body().getWorldTransform().getOrigin() - first;
  out.creep = std::hypot(double(moved.x()), double(moved.z())) * SceneOptions{}.rate / (kBunnySteps - kFirstTimed);
  return out;
}

std::vector<double> timed(const std::vector<double>& all) {
  return {all.begin() + kFirstTimed, all.end()};
}

// A fall is reproducible to the bit, so that a step's time is the median of its rounds.
Fall fall_in_rounds(const Side& side, const Floor& floor, const Bunnies& bunnies, const btMatrix3x3& rotation) {
  // GImpact takes up to tens of milliseconds a step.
  const int rounds = side.name == bunnies.gimpact.name ? 1 : kRounds;
  std::vector<Fall> falls;
  for (int round = 0; round < rounds; ++round) falls.push_back(fall(side, floor, bunnies.corners, rotation));
  Fall out = falls[0];
  for (const auto times : {&Fall::microseconds, &Fall::step_us}) {
    for (std::size_t step = 0; step < (out.*times).size(); ++step) {
      std::vector<double> of_rounds;
      for (const Fall& one : falls) of_rounds.push_back((one.*times)[step]);
      (out.*times)[step] = median(of_rounds);
    }
  }
  return out;
}

}  // namespace

nlohmann::json run_bunny(const Bunnies& bunnies, const std::vector<Floor>& floors) {
  std::vector<Side> peers{bunnies.hull};
  peers.insert(peers.end(), bunnies.hacd.begin(), bunnies.hacd.end());
  peers.push_back(bunnies.gimpact);
  const std::vector<Side> own{ours("ours, low", bunnies.low),
                              ours("ours, fine", bunnies.fine),
                              ours("ours, low, L = 1", bunnies.low_k4, 1),
                              ours("ours, low, L = 4", bunnies.low_k4, 4),
                              advanced(ours("ours, low", bunnies.low)),
                              advanced(ours("ours, fine", bunnies.fine))};
  nlohmann::json runs = nlohmann::json::array();
  for (const Floor& floor : floors) {
    std::vector<Side> sides = own;
    // Bullet's own shapes have no points for contacts with a voxelmap.
    if (floor.name != "baked") sides.insert(sides.begin(), peers.begin(), peers.end());
    for (const Side& side : sides) {
      fmt::print(stderr, "paper_runs: bunny, {}, {}\n", floor.name, side.name);
      const Fall one = fall_in_rounds(side, floor, bunnies, btMatrix3x3::getIdentity());
      runs.push_back({{"floor", floor.name},
                      {"side", side.name},

                      {"mean_us", mean(timed(one.microseconds))},
                      {"mean_step_us", mean(timed(one.step_us))},
                      {"median_us", median(timed(one.microseconds))},
                      {"creep", one.creep},
                      {"deepest", -*std::min_element(one.lowest.begin(), one.lowest.end())},
                      {"deepest_timed", -*std::min_element(one.lowest.begin() + kFirstTimed, one.lowest.end())},
                      {"microseconds", one.microseconds},
                      {"speed", one.speed},
                      {"energy", one.energy},
                      {"lowest", one.lowest}});
    }
  }
  return {{"runs", runs},
          {"rounds", kRounds},
          {"triangles", bunnies.triangles},
          {"dims", bunnies.fine.asset->info().dims},
          {"points", {bunnies.low.asset->info().points, bunnies.fine.asset->info().points}},
          {"covering_radius", {bunnies.low.asset->info().covering_radius, bunnies.fine.asset->info().covering_radius}}};
}

nlohmann::json run_levels(const Bunnies& bunnies, const std::vector<Floor>& floors) {
  struct Row {
    std::string name;
    std::vector<Side> sides;
  };
  std::vector<Row> rows{{"low", {}}, {"fine", {}}};
  for (std::uint32_t level = 1; level <= kLevels; ++level) {
    rows[0].sides.push_back(ours(fmt::format("L = {}", level), bunnies.low_k4, level));
    rows[1].sides.push_back(ours(fmt::format("L = {}", level), bunnies.fine_k4, level));
  }
  rows[0].sides.push_back(ours("regular", bunnies.low));
  rows[1].sides.push_back(ours("regular", bunnies.fine));
  rows.push_back({"Bullet", {bunnies.hull}});
  rows[2].sides.insert(rows[2].sides.end(), bunnies.hacd.begin(), bunnies.hacd.end());
  rows[2].sides.push_back(bunnies.gimpact);

  const std::vector<btMatrix3x3> rotations = random_rotations(kRotations);
  nlohmann::json runs = nlohmann::json::array();
  for (const Floor& floor : floors) {
    for (const Row& row : rows) {
      for (const Side& side : row.sides) {
        if (row.name == "Bullet" && !meets(side, floor, bunnies)) continue;
        fmt::print(stderr, "paper_runs: levels, {}, {}, {}\n", floor.name, row.name, side.name);
        std::vector<double> means;
        std::vector<double> deepest;
        std::vector<double> speeds;
        for (const btMatrix3x3& rotation : rotations) {
          const Fall one = fall_in_rounds(side, floor, bunnies, rotation);
          means.push_back(mean(timed(one.microseconds)));
          deepest.push_back(-*std::min_element(one.lowest.begin(), one.lowest.end()));
          speeds.push_back(one.speed.back());
        }
        runs.push_back({{"floor", floor.name},
                        {"row", row.name},
                        {"side", side.name},
                        {"mean_us", mean(means)},
                        {"deepest", *std::max_element(deepest.begin(), deepest.end())},
                        {"fastest_at_end", *std::max_element(speeds.begin(), speeds.end())}});
      }
    }
  }
  return {{"runs", runs},
          {"rotations", kRotations},
          {"clusters", {clusters_of_levels(*bunnies.low_k4.asset), clusters_of_levels(*bunnies.fine_k4.asset)}}};
}

}  // namespace vps::paper

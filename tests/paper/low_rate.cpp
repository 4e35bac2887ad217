// SPDX-License-Identifier: GPL-3.0-or-later
// The lowest rate at which a dropped bunny stays on the plane. Paper: Sec. 4.2.2.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "tests/paper/paper.h"
#include "tests/paper/scene.h"

namespace vps::paper {
namespace {

constexpr double kRates[] = {200, 100, 60, 50, 40, 30, 25, 20, 15, 12, 10, 8, 6, 5, 4, 3, 2, 1};  // [Hz]
constexpr double kDuration = 20;                                                                  // [s]
constexpr double kLast = 2;  // end of the duration in which the bunny must rest. [s]
// It rests when its lowest point is no deeper and no higher than this.
constexpr double kDeepestAtEnd = 0.010;    // [m]
constexpr double kHighestAtEnd = 0.010;    // [m]
constexpr double kHigherThanStart = 0.01;  // a larger rise means that energy was created. [m]

struct Outcome {
  double deepest = 0;           // ever. [m]
  double deepest_at_end = 0;    // in the last seconds. [m]
  double highest_at_end = 0;    // lowest point in the last seconds. [m]
  double lowest_centre = 1e30;  // in the last seconds. [m]
  double climbed = 0;           // largest rise of the centre above its start. [m]
  // The paper's "maintained above the plane".
  [[nodiscard]] bool above() const { return lowest_centre > 0 && climbed <= kHigherThanStart; }
  [[nodiscard]] bool rests() const {
    return above() && deepest_at_end <= kDeepestAtEnd && highest_at_end <= kHighestAtEnd;
  }
};

Outcome watch(Drop drop, double rate) {
  const double start = drop.height();
  const int steps = int(std::lround(kDuration * rate));
  const int last = steps - int(std::lround(kLast * rate));
  Outcome out;
  for (int step = 0; step < steps; ++step) {
    drop.step();
    const double lowest = drop.lowest();
    out.deepest = std::max(out.deepest, -lowest);
    out.climbed = std::max(out.climbed, drop.height() - start);
    if (step < last) continue;
    out.deepest_at_end = std::max(out.deepest_at_end, -lowest);
    out.highest_at_end = std::max(out.highest_at_end, lowest);
    out.lowest_centre = std::min(out.lowest_centre, drop.height());
  }
  return out;
}

}  // namespace

nlohmann::json run_low_rates(const Bunnies& bunnies, const std::vector<Floor>& floors) {
  std::vector<Side> own;
  for (const std::uint32_t level : {1U, 4U, 5U}) {
    own.push_back(ours(fmt::format("ours, low, L = {}", level), bunnies.low_k4, level));
    own.push_back(ours(fmt::format("ours, fine, L = {}", level), bunnies.fine_k4, level));
  }
  own.push_back(ours("ours, low, regular", bunnies.low));
  own.push_back(ours("ours, fine, regular", bunnies.fine));
  for (std::size_t discrete = 2; discrete < 8; ++discrete) own.push_back(advanced(own[discrete]));  // all but L = 1
  std::vector<Side> peers{bunnies.hull};
  peers.insert(peers.end(), bunnies.hacd.begin(), bunnies.hacd.end());
  peers.push_back(bunnies.gimpact);

  const std::vector<btMatrix3x3> rotations = random_rotations(kRotations);
  nlohmann::json runs = nlohmann::json::array();
  for (const Floor& floor : floors) {
    std::vector<Side> sides = own;
    const auto asked = [&](const Side& peer) { return meets(peer, floor, bunnies); };
    std::copy_if(peers.begin(), peers.end(), std::back_inserter(sides), asked);
    for (const Side& side : sides) {
      fmt::print(stderr, "paper_runs: low rates, {}, {}\n", floor.name, side.name);
      for (const double rate : kRates) {
        SceneOptions options;
        options.rate = rate;
        Outcome worst;
        int above = 0;
        int rests = 0;
        for (const btMatrix3x3& rotation : rotations) {
          const Outcome one = watch(Drop(side, floor, bunnies.corners, rotation, options), rate);
          above += one.above() ? 1 : 0;
          rests += one.rests() ? 1 : 0;
          worst.deepest = std::max(worst.deepest, one.deepest);
          worst.deepest_at_end = std::max(worst.deepest_at_end, one.deepest_at_end);
          worst.highest_at_end = std::max(worst.highest_at_end, one.highest_at_end);
          worst.climbed = std::max(worst.climbed, one.climbed);
        }
        runs.push_back({{"floor", floor.name},
                        {"side", side.name},
                        {"rate", rate},
                        {"above", above},
                        {"rests", rests},
                        {"deepest", worst.deepest},
                        {"deepest_at_end", worst.deepest_at_end},
                        {"highest_at_end", worst.highest_at_end},
                        {"climbed", worst.climbed}});
      }
    }
  }
  return {{"runs", runs},
          {"rotations", kRotations},
          {"duration", kDuration},
          {"last", kLast},
          {"deepest_at_end_limit", kDeepestAtEnd},
          {"highest_at_end_limit", kHighestAtEnd},
          {"climbed_limit", kHigherThanStart}};
}

}  // namespace vps::paper

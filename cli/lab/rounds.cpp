// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/rounds.h"

#include <cmath>

namespace vps::lab {
namespace {

std::vector<PairAnswer> ask(PairPeer& peer, std::span<const Pose> poses) {
  std::vector<PairAnswer> answers;
  for (const Pose& pose : poses) answers.push_back(peer.query(pose));
  return answers;
}

std::vector<double> time_round(PairPeer& peer, std::span<const Pose> poses, int passes) {
  std::vector<std::vector<double>> of_pose(poses.size());
  for (int pass = 0; pass < passes; ++pass) {
    for (std::size_t i = 0; i < poses.size(); ++i) of_pose[i].push_back(peer.query(poses[i]).microseconds);
  }
  std::vector<double> out;
  for (auto& us : of_pose) out.push_back(percentile(std::move(us), 0.5));
  return out;
}

}  // namespace

std::vector<ContenderResult> ask_in_turn(std::span<const Contender> sides, std::span<const Pose> poses,
                                         const RoundOptions& options) {
  constexpr int kPasses = 3;
  constexpr double kSlow = 2e5;  // [us]
  std::vector<ContenderResult> results(sides.size());
  std::vector<std::vector<std::vector<double>>> rounds(sides.size());
  if (poses.empty()) return results;
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t s = 0; s < sides.size(); ++s) {
      if (options.progress) {
        options.progress(sides[s].name, (double(round) + double(s) / double(sides.size())) / double(options.rounds));
      }
      const bool timed = round == 0 || !std::isnan(results[s].answers[0].microseconds);
      if (!timed) continue;
      const std::unique_ptr<PairPeer> peer = sides[s].make();
      const auto begin = Clock::now();
      std::vector<PairAnswer> warm_up = ask(*peer, poses);
      const bool slow = microseconds_since(begin) > kSlow;
      if (round == 0) results[s].answers = std::move(warm_up);
      if (std::isnan(results[s].answers[0].microseconds)) continue;
      rounds[s].push_back(time_round(*peer, poses, slow ? 1 : kPasses));
    }
  }
  for (std::size_t s = 0; s < sides.size(); ++s) results[s].times = times_of(rounds[s]);
  return results;
}

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Queries all contenders at the same poses in turn, round by round. A machine that slows down then slows down
/// all of them.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "cli/lab/pair.h"
#include "cli/lab/statistics.h"

namespace vps::lab {

struct Contender {
  std::string name;
  /// Called in every round, so that the measured noise includes the effect of memory layout.
  std::function<std::unique_ptr<PairPeer>()> make;
};

struct ContenderResult {
  std::vector<PairAnswer> answers;  ///< per pose, from its first query
  Times times;
};

struct RoundOptions {
  int rounds = 5;  ///< [Limits: value > 0]
  /// `fraction`: 0 to 1. May be empty.
  std::function<void(const std::string& side, double fraction)> progress;
};

/// In each round a new object of a side queries every pose once to warm up and three times for timing, or once if it is
/// slow. The round's time of a pose is the median. Sides without times are queried in the first round only.
[[nodiscard]] std::vector<ContenderResult> ask_in_turn(std::span<const Contender> sides, std::span<const Pose> poses,
                                                       const RoundOptions& options);

}  // namespace vps::lab

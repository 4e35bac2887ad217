// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Queries all contenders at the same poses in turn, round by round, so that a machine that slows down slows down
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
  /// Made anew in every round, so that noise from where memory lies is in the noise that is told.
  std::function<std::unique_ptr<PairPeer>()> make;
};

struct ContenderResult {
  std::vector<PairAnswer> answers;  ///< per pose, of the first time that it was asked
  Times times;
};

struct RoundOptions {
  int rounds = 5;  ///< [Limits: value > 0]
  /// 0 to 1; may be empty.
  std::function<void(const std::string& side, double fraction)> progress;
};

/// A round asks a new peer every pose once to warm up and three times to be timed, slow ones once: the round's time of
/// a pose is the median. Sides without times are asked once in all.
[[nodiscard]] std::vector<ContenderResult> ask_in_turn(std::span<const Contender> sides, std::span<const Pose> poses,
                                                       const RoundOptions& options);

}  // namespace vps::lab

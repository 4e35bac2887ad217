// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Progress of loops inside a stage. Internal to bake.
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>

namespace vps::bake {

/// Takes the part of a stage that is done, 0 to 1. Called from any thread; may be empty.
using StageProgress = std::function<void(double fraction)>;

/// Counts the steps of a parallel loop, and reports about a hundred of them.
class LoopProgress {
 public:
  LoopProgress(const StageProgress& progress, std::size_t steps) : progress_(progress), steps_(steps) {}
  void step() {
    const std::size_t done = ++done_;
    if (progress_ && (100 * done / steps_ != 100 * (done - 1) / steps_)) progress_(double(done) / double(steps_));
  }

 private:
  const StageProgress& progress_;
  std::size_t steps_;
  std::atomic<std::size_t> done_{0};
};

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs the stages of a bake side by side: each starts when those that it needs are done. Internal to bake.
#pragma once

#include <atomic>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <initializer_list>
#include <mutex>
#include <vector>

#include "bake/vps_bake.h"

namespace vps::bake {

class StageGraph {
 public:
  using Stage = std::size_t;  ///< in the order of `add`

  /// @param progress  see BakeOptions::progress; may be empty
  explicit StageGraph(std::function<void(const char* stage, double fraction)> progress)
      : progress_(std::move(progress)) {}

  /// @param after  earlier stages whose results the work needs
  Stage add(const char* name, std::initializer_list<Stage> after, std::function<void()> work);

  /// Sets the expected times of all stages, in any unit; else they count alike. A stage may do so while it is the only
  /// one that runs.
  void expect(const std::function<double(const char* name)>& time);

  /// A stage reports which part of its work is done, 0 to 1. From any thread.
  void advance(Stage stage, double fraction);

  /// Runs all stages once. Work that runs in parallel inside a stage never waits for another stage.
  /// @throw what the first stage that failed threw; none is started after a failure
  void run();

  /// Of the last run, in the order of `add`. Stages are `critical` on the path through the graph that took longest.
  [[nodiscard]] std::vector<StageTime> times() const;

 private:
  struct Node {
    const char* name;
    std::function<void()> work;
    std::vector<Stage> after, before;
    std::atomic<std::size_t> missing{0};  // stages that it waits for
    double expected = 1, done = 0;        // time, and the part of the work
    double seconds = 0;
    std::exception_ptr failure = nullptr;
  };
  void work_on(Node& node);
  void report(const char* stage);  // with the lock

  std::function<void(const char* stage, double fraction)> progress_;
  std::deque<Node> nodes_;
  std::mutex announcing_;
  double told_ = 0;
  std::atomic<bool> failed_{false};
};

}  // namespace vps::bake

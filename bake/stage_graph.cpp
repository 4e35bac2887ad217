// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stage_graph.h"

#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <chrono>

namespace vps::bake {

StageGraph::Stage StageGraph::add(const char* name, std::initializer_list<Stage> after, std::function<void()> work) {
  const Stage stage = nodes_.size();
  Node& node = nodes_.emplace_back();
  node.name = name;
  node.work = std::move(work);
  node.after = after;
  for (const Stage s : after) nodes_[s].before.push_back(stage);
  return stage;
}

void StageGraph::expect(const std::function<double(const char* name)>& time) {
  const std::scoped_lock lock(announcing_);
  for (Node& node : nodes_) node.expected = time(node.name);
}

void StageGraph::advance(Stage stage, double fraction) {
  const std::scoped_lock lock(announcing_);
  nodes_[stage].done = std::max(nodes_[stage].done, fraction);
  report(nodes_[stage].name);
}

void StageGraph::report(const char* stage) {
  double done = 0, all = 0;
  for (const Node& node : nodes_) {
    done += node.expected * node.done;
    all += node.expected;
  }
  if (all > 0) told_ = std::max(told_, std::min(done / all, 1.0));
  if (progress_) progress_(stage, told_);
}

void StageGraph::work_on(Node& node) {
  if (failed_) return;
  try {
    {
      const std::scoped_lock lock(announcing_);
      report(node.name);
    }
    const auto begin = std::chrono::steady_clock::now();
    // Without isolation a thread that waits for the end of a parallel loop would begin another stage meanwhile.
    tbb::this_task_arena::isolate(node.work);
    node.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const std::scoped_lock lock(announcing_);
    node.done = 1;
  } catch (...) {
    node.failure = std::current_exception();
    failed_ = true;
  }
}

void StageGraph::run() {
  told_ = 0;
  failed_ = false;
  for (Node& node : nodes_) {
    node.missing = node.after.size();
    node.seconds = node.done = 0;
    node.failure = nullptr;
  }
  tbb::task_group group;
  std::function<void(Stage)> start;
  const auto finish = [&](Stage stage) {
    work_on(nodes_[stage]);
    for (const Stage next : nodes_[stage].before) {
      if (--nodes_[next].missing == 0) start(next);
    }
  };
  start = [&](Stage stage) { group.run([&finish, stage] { finish(stage); }); };
  for (Stage stage = 0; stage < nodes_.size(); ++stage) {
    if (nodes_[stage].after.empty()) start(stage);
  }
  group.wait();
  for (const Node& node : nodes_) {
    if (node.failure) std::rethrow_exception(node.failure);
  }
  if (progress_) progress_("done", 1);
}

std::vector<StageTime> StageGraph::times() const {
  std::vector<StageTime> times;
  std::vector<double> ends(nodes_.size());  // if every stage began as soon as it could
  const auto latest = [&](const std::vector<Stage>& stages) {
    return *std::max_element(stages.begin(), stages.end(), [&](Stage a, Stage b) { return ends[a] < ends[b]; });
  };
  for (Stage stage = 0; stage < nodes_.size(); ++stage) {
    const Node& node = nodes_[stage];
    ends[stage] = node.seconds + (node.after.empty() ? 0 : ends[latest(node.after)]);
    times.push_back({node.name, node.seconds, false});
  }
  if (nodes_.empty()) return times;
  auto last = static_cast<Stage>(std::max_element(ends.begin(), ends.end()) - ends.begin());
  times[last].critical = true;
  while (!nodes_[last].after.empty()) times[last = latest(nodes_[last].after)].critical = true;
  return times;
}

}  // namespace vps::bake

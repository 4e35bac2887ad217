// SPDX-License-Identifier: GPL-3.0-or-later
// Measures by how much queries exceed a time budget: an asset's shell against its own voxelmap, in deep penetration.
//
//     budget_overrun ASSET [MICROSECONDS [CALLS]]
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "runtime/vps_runtime.h"
#include "tests/support/random.h"

namespace {

using Clock = std::chrono::steady_clock;

// How often the system has preempted this thread, which no budget can prevent.
long interruptions() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw;
}

void print(const char* name, std::vector<float>& overrun) {
  std::sort(overrun.begin(), overrun.end());
  const auto at = [&](double part) {
    return static_cast<double>(overrun[static_cast<std::size_t>(part * static_cast<double>(overrun.size() - 1))]);
  };
  std::printf("| %s | %zu | %.2f | %.2f | %.2f | %.2f | %.2f |\n", name, overrun.size(), at(0.5), at(0.99), at(0.999),
              at(0.99999), at(1));
}

}  // namespace

int main(int count, char** arguments) {
  vps::Asset asset;
  vps::VoxelmapView map;
  vps::PointshellView shell;
  if (count < 2 || vps::Asset::open(arguments[1], asset) != vps::Status::ok ||
      asset.voxelmap(map, vps::Field::scaled) != vps::Status::ok || asset.pointshell(shell) != vps::Status::ok) {
    std::fprintf(stderr, "budget_overrun ASSET [MICROSECONDS [CALLS]]: needs an asset with both parts\n");
    return 1;
  }
  vps::QueryOptions options;
  options.max_microseconds = count > 2 ? std::strtof(arguments[2], nullptr) : 100;
  const long calls = count > 3 ? std::strtol(arguments[3], nullptr, 10) : 1'000'000;
  std::vector<float> areas(shell.nodes);
  if (vps::node_areas(shell, areas) != vps::Status::ok) return 1;
  options.node_areas = areas;

  vps::Scratch scratch;
  scratch.reserve(shell);
  std::vector<vps::Contact> contacts(shell.points);
  vps::test::Random random;
  std::vector<float> all;
  std::vector<float> undisturbed;
  all.reserve(static_cast<std::size_t>(calls));
  undisturbed.reserve(static_cast<std::size_t>(calls));
  long complete = 0;
  for (long call = 0; call < calls; ++call) {
    vps::Pose pose;
    const auto rotation = random.rotation();
    std::copy(rotation.begin(), rotation.end(), pose.rotation);
    for (int axis = 0; axis < 3; ++axis) {
      pose.translation[axis] = random.between(-0.1, 0.1) * (map.bounds_max[axis] - map.bounds_min[axis]);
    }
    const long before = interruptions();
    const Clock::time_point start = Clock::now();
    vps::QueryResult result;
    if (vps::traverse(shell, map, pose, options, scratch, contacts, result) != vps::Status::ok) return 1;
    const auto spent = std::chrono::duration<float, std::micro>(Clock::now() - start).count();
    complete += result.complete;
    const float overrun = std::max(0.0F, spent - options.max_microseconds);
    all.push_back(overrun);
    if (interruptions() == before) undisturbed.push_back(overrun);
  }
  std::printf("Overrun of a budget of %.0f us [us]; %u points, %.1f %% of %ld calls complete\n\n",
              static_cast<double>(options.max_microseconds), shell.points,
              100.0 * static_cast<double>(complete) / static_cast<double>(calls), calls);
  std::printf("| calls | number | median | 99 %% | 99.9 %% | 99.999 %% | most |\n|---|---|---|---|---|---|---|\n");
  print("all", all);
  print("never off the core", undisturbed);
  return 0;
}

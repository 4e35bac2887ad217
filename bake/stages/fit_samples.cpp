// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/fit_samples.h"

#include <algorithm>
#include <cmath>

#include "bake/stages/fine_samples.h"

namespace vps::bake {
namespace {

constexpr int kCoarse = static_cast<int>(kFieldEdge);
constexpr int kFine = FineSamples::kEdge;

using FineValues = std::array<double, FineSamples::kCount>;

// The largest value in the cube of fine samples that each sample weighs at, axis by axis.
void largest_around(const FineValues& fine, BrickValues& largest) {
  const auto narrow = [](const double* from, double* to, int step, int count) {
    for (int i = 0; i < kCoarse; ++i) {
      const double* const first = from + std::max(2 * i - 1, 0) * step;
      const double* const here = from + 2 * i * step;
      const double* const last = from + std::min(2 * i + 1, kFine - 1) * step;
      for (int n = 0; n < count; ++n) to[i * count + n] = std::max({first[n], here[n], last[n]});
    }
  };
  double xy[kFine][kCoarse][kCoarse];
  for (int z = 0; z < kFine; ++z) {
    double x[kFine][kCoarse];
    for (int y = 0; y < kFine; ++y) narrow(fine.data() + (z * kFine + y) * kFine, x[y], 1, 1);
    narrow(x[0], xy[z][0], kCoarse, kCoarse);
  }
  narrow(xy[0][0], largest.data(), kCoarse * kCoarse, kCoarse * kCoarse);
}

}  // namespace

bool fit_samples(const FineSamples& fine, const BrickValues& value, double step, double farthest, BrickValues& fitted) {
  // Found by experiment: more rounds find hardly any more.
  constexpr int kRounds = 4;
  FineValues unknown;
  for (std::size_t at = 0; at < FineSamples::kCount; ++at) unknown[at] = fine.limit[at] == FineSamples::kUnknown;
  BrickValues near_unknown;
  largest_around(unknown, near_unknown);
  bool moved = false;
  for (int round = 0; round < kRounds; ++round) {
    FineValues error;
    fill_between<kCoarse>(
        fitted, [](double a, double b) { return (a + b) / 2; }, error);
    // How far errors go beyond what is allowed, upwards and downwards. Negative where there is room.
    FineValues up;
    FineValues down;
    for (std::size_t at = 0; at < FineSamples::kCount; ++at) {
      error[at] -= fine.value[at];
      up[at] = error[at] - fine.limit[at];
      down[at] = -error[at] - fine.limit[at];
    }
    BrickValues most_up;
    BrickValues most_down;
    largest_around(up, most_up);
    largest_around(down, most_down);
    bool moved_now = false;
    for (std::size_t n = 0; n < fitted.size(); ++n) {
      const bool may_move = near_unknown[n] == 0 && std::abs(value[n]) > std::max(step, farthest);
      if (!may_move || std::max(most_up[n], most_down[n]) <= 0) continue;
      const double wanted = fitted[n] - (most_up[n] - most_down[n]) / 2;
      const double shifted = std::clamp(wanted, value[n] - farthest, value[n] + farthest);
      if (shifted == fitted[n]) continue;
      fitted[n] = shifted;
      moved_now = true;
    }
    // Another round would not move any, either.
    if (!moved_now) break;
    moved = true;
  }
  return moved;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/fit_samples.h"

#include <algorithm>
#include <cmath>

#include "bake/stages/fine_samples.h"

namespace vps::bake {
namespace {

constexpr int kEdge = static_cast<int>(kFieldEdge);
constexpr int kFine = FineSamples::kEdge;

// How far errors around a sample go beyond what is allowed: upwards, downwards. Negative where there is room.
struct Excess {
  double up = -FineSamples::kAnyError;
  double down = -FineSamples::kAnyError;
};

// The cube of fine samples that a sample weighs at.
template <class Visit>
void for_each_around(int x, int y, int z, Visit visit) {
  const auto low = [](int i) { return std::max(2 * i - 1, 0); };
  const auto high = [](int i) { return std::min(2 * i + 1, kFine - 1); };
  for (int k = low(z); k <= high(z); ++k) {
    for (int j = low(y); j <= high(y); ++j) {
      for (int i = low(x); i <= high(x); ++i) visit(static_cast<std::size_t>((k * kFine + j) * kFine + i));
    }
  }
}

template <class Visit>
void for_each_sample(Visit visit) {
  std::size_t n = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) visit(n++, x, y, z);
    }
  }
}

}  // namespace

bool fit_samples(const FineSamples& fine, const BrickValues& value, double step, double farthest, BrickValues& fitted) {
  // Found by experiment: more rounds find hardly any more.
  constexpr int kRounds = 4;
  std::array<bool, std::tuple_size_v<BrickValues>> may_move;
  for_each_sample([&](std::size_t n, int x, int y, int z) {
    may_move[n] = std::abs(value[n]) > std::max(step, farthest);
    for_each_around(x, y, z, [&](std::size_t at) { may_move[n] &= fine.limit[at] != FineSamples::kUnknown; });
  });
  bool moved = false;
  std::array<double, FineSamples::kCount> error;
  for (int round = 0; round < kRounds; ++round) {
    fill_between<kEdge>(
        fitted, [](double a, double b) { return (a + b) / 2; }, error);
    for (std::size_t at = 0; at < FineSamples::kCount; ++at) error[at] -= fine.value[at];
    for_each_sample([&](std::size_t n, int x, int y, int z) {
      if (!may_move[n]) return;
      Excess excess;
      for_each_around(x, y, z, [&](std::size_t at) {
        excess.up = std::max(excess.up, error[at] - fine.limit[at]);
        excess.down = std::max(excess.down, -error[at] - fine.limit[at]);
      });
      if (std::max(excess.up, excess.down) <= 0) return;
      const double wanted = fitted[n] - (excess.up - excess.down) / 2;
      const double shifted = std::clamp(wanted, value[n] - farthest, value[n] + farthest);
      if (shifted == fitted[n]) return;
      fitted[n] = shifted;
      moved = true;
    });
  }
  return moved;
}

}  // namespace vps::bake

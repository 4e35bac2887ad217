// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/octant_trial.h"

#include <algorithm>
#include <cmath>

namespace vps::bake {
namespace {

constexpr int kFineEdge = static_cast<int>(kFieldEdge);
using FineSamples = std::array<float, 128>;

// The samples of a brick of half the size: every second one is a sample of the coarse brick, the ones between combine
// their neighbours, axis by axis.
template <class Combine>
void fill_between(const std::array<float, 27>& coarse, Combine combine, FineSamples& fine) {
  const auto widen = [&](const float* from, int from_step, float* to, int to_step) {
    for (int i = 0; i < 2; ++i) {
      to[2 * i * to_step] = from[i * from_step];
      to[(2 * i + 1) * to_step] = combine(from[i * from_step], from[(i + 1) * from_step]);
    }
    to[4 * to_step] = from[2 * from_step];
  };
  float x[3][3][kFineEdge];
  float xy[3][kFineEdge][kFineEdge];
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 3; ++y) widen(coarse.data() + (z * 3 + y) * 3, 1, x[z][y], 1);
    for (int i = 0; i < kFineEdge; ++i) widen(&x[z][0][i], kFineEdge, &xy[z][0][i], kFineEdge);
  }
  for (int i = 0; i < kFineEdge * kFineEdge; ++i)
    widen(&xy[0][0][0] + i, kFineEdge * kFineEdge, fine.data() + i, kFineEdge * kFineEdge);
}

// Distance of a fine sample from the nearest corners of the coarse cell around it, in steps: 0 where it is one of them.
constexpr FineSamples corner_distances() {
  constexpr float kRoots[4] = {0, 1, 1.4142136F, 1.7320508F};
  FineSamples distances{};
  for (int n = 0; n < kFineEdge * kFineEdge * kFineEdge; ++n) {
    const int odd = (n % kFineEdge & 1) + (n / kFineEdge % kFineEdge & 1) + (n / (kFineEdge * kFineEdge) & 1);
    distances[static_cast<std::size_t>(n)] = kRoots[odd];
  }
  return distances;
}
constexpr FineSamples kCornerDistances = corner_distances();

}  // namespace

bool surely_interpolates(const OctantTrial& trial, const FieldTolerance& tolerance_vx,
                         const std::function<bool(std::size_t)>& is_inside) {
  FineSamples interpolated{};
  FineSamples surest{};
  fill_between(
      trial.fitted, [](float a, float b) { return (a + b) / 2; }, interpolated);
  // The surface cannot pass between two points if their distance is less than the sum of their distances to it.
  fill_between(
      trial.value, [](float a, float b) { return std::abs(b) > std::abs(a) ? b : a; }, surest);
  // Values are at most reach + 1, and sums of two at most twice that. Rounding values, means, limits and differences
  // adds at most 12 roundings to nearest of such a sum.
  const float slack = trial.error + 32 * (trial.reach + 1) / (1 << 24);
  const auto tolerance = static_cast<float>(tolerance_vx.error);
  // How much the error exceeds what is allowed, at most; negative where it surely does not.
  const auto excess = [&](float error, float least, float core, float band) {
    const float limit = least > core ? tolerance + static_cast<float>(kErrorGrowth) * (least - core) : tolerance;
    return least > band ? -1.0F : error + slack - limit;
  };
  const auto band_inner = static_cast<float>(tolerance_vx.band_inner);
  const auto band_outer = static_cast<float>(tolerance_vx.band_outer);
  const auto core_inner = static_cast<float>(tolerance_vx.band_inner - kHalfDiagonal);
  const auto core_outer = static_cast<float>(tolerance_vx.band_outer - kHalfDiagonal);
  FineSamples inner;
  FineSamples outer;
  float hopeless = -1;
  for (std::size_t n = 0; n < inner.size(); ++n) {
    const float distance = std::min(trial.distance[n], trial.reach);
    const float least = distance - slack;
    const float gap = trial.step * kCornerDistances[n];
    const bool known = least + std::abs(surest[n]) > gap;
    const bool tested = gap > 0;
    const float as_inner = excess(std::abs(interpolated[n] - distance), least, core_inner, band_inner);
    const float as_outer = excess(std::abs(interpolated[n] + distance), least, core_outer, band_outer);
    inner[n] = !tested || (known && surest[n] < 0) ? -1.0F : as_inner;
    outer[n] = !tested || (known && surest[n] > 0) ? -1.0F : as_outer;
    hopeless = std::max(hopeless, std::min(inner[n], outer[n]));
  }
  if (!(hopeless < 0)) return false;
  // The side matters where the error is only small enough on one of them.
  for (std::size_t n = 0; n < inner.size(); ++n) {
    if (std::max(inner[n], outer[n]) < 0) continue;
    if (!((is_inside(n) ? inner[n] : outer[n]) < 0)) return false;
  }
  return true;
}

}  // namespace vps::bake

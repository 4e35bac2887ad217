// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/octant_trial.h"

#include <algorithm>
#include <cmath>

#include "bake/stages/fine_samples.h"

namespace vps::bake {
namespace {

constexpr int kFineEdge = static_cast<int>(kFieldEdge);
using Samples128 = std::array<float, 128>;

// Distance of a fine sample from the nearest corners of the coarse cell around it, in steps: 0 where it is one of them.
constexpr Samples128 corner_distances() {
  constexpr float kRoots[4] = {0, 1, 1.4142136F, 1.7320508F};
  Samples128 distances{};
  for (int n = 0; n < kFineEdge * kFineEdge * kFineEdge; ++n) {
    const int odd = (n % kFineEdge & 1) + (n / kFineEdge % kFineEdge & 1) + (n / (kFineEdge * kFineEdge) & 1);
    distances[static_cast<std::size_t>(n)] = kRoots[odd];
  }
  return distances;
}
constexpr Samples128 kCornerDistances = corner_distances();

}  // namespace

bool surely_interpolates(const OctantTrial& trial, const FieldTolerance& tolerance_vx, double noted,
                         const std::function<bool(std::size_t)>& is_inside) {
  Samples128 interpolated{};
  Samples128 surest{};
  fill_between<3>(
      trial.fitted, [](float a, float b) { return (a + b) / 2; }, interpolated);
  // The surface cannot pass between two points if their distance is less than the sum of their distances to it.
  fill_between<3>(
      trial.value, [](float a, float b) { return std::abs(b) > std::abs(a) ? b : a; }, surest);
  // Values are at most reach + 1, and sums of two at most twice that. Rounding values, means, limits and differences
  // adds at most 12 roundings to nearest of such a sum.
  const float slack = trial.error + 32 * (trial.reach + 1) / (1 << 24);
  const auto tolerance = static_cast<float>(tolerance_vx.error);
  const auto exact_from = static_cast<float>(std::min(noted, tolerance_vx.error));
  // How much the error exceeds what is allowed, at most; negative where it surely does not.
  const auto excess = [&](float error, float least, float core, float band) {
    const float limit = least > core ? tolerance + static_cast<float>(kErrorGrowth) * (least - core) : exact_from;
    return least > band ? -1.0F : error + slack - limit;
  };
  const auto band_inner = static_cast<float>(tolerance_vx.band_inner);
  const auto band_outer = static_cast<float>(tolerance_vx.band_outer);
  const auto core_inner = static_cast<float>(tolerance_vx.band_inner - kHalfDiagonal);
  const auto core_outer = static_cast<float>(tolerance_vx.band_outer - kHalfDiagonal);
  Samples128 inner;
  Samples128 outer;
  // Without branches, so that compilers vectorize it.
  for (std::size_t n = 0; n < inner.size(); ++n) {
    const float distance = std::min(trial.distance[n], trial.reach);
    const float least = distance - slack;
    const float gap = trial.step * kCornerDistances[n];
    // 0 where the side is not known.
    const float side = least + std::abs(surest[n]) > gap ? surest[n] : 0.0F;
    const float as_inner = excess(std::abs(interpolated[n] - distance), least, core_inner, band_inner);
    const float as_outer = excess(std::abs(interpolated[n] + distance), least, core_outer, band_outer);
    inner[n] = side < 0 ? -1.0F : as_inner;
    outer[n] = side > 0 ? -1.0F : as_outer;
    inner[n] = gap > 0 ? inner[n] : -1.0F;
    outer[n] = gap > 0 ? outer[n] : -1.0F;
  }
  for (std::size_t n = 0; n < inner.size(); ++n) {
    if (!(std::min(inner[n], outer[n]) < 0)) return false;
  }
  // The side matters where the error is only small enough on one of them.
  for (std::size_t n = 0; n < inner.size(); ++n) {
    if (std::max(inner[n], outer[n]) < 0) continue;
    if (!((is_inside(n) ? inner[n] : outer[n]) < 0)) return false;
  }
  return true;
}

}  // namespace vps::bake

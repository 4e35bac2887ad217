// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Every operation is rounded by itself.
#include "bake/stages/octant_trial.h"

#include <algorithm>
#include <cmath>

#include "bake/stages/fine_samples.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/octant_trial.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_OCTANT_TRIAL_ONCE
#define VPS_OCTANT_TRIAL_ONCE
namespace vps::bake::detail {

inline constexpr int kFineEdge = static_cast<int>(kFieldEdge);
using Samples128 = std::array<float, 128>;

// Distance of a fine sample from the nearest corners of the coarse cell around it, in steps: 0 where it is one of them.
inline constexpr Samples128 corner_distances() {
  constexpr float kRoots[4] = {0, 1, 1.4142136F, 1.7320508F};
  Samples128 distances{};
  for (int n = 0; n < kFineEdge * kFineEdge * kFineEdge; ++n) {
    const int odd = (n % kFineEdge & 1) + (n / kFineEdge % kFineEdge & 1) + (n / (kFineEdge * kFineEdge) & 1);
    distances[static_cast<std::size_t>(n)] = kRoots[odd];
  }
  return distances;
}
inline constexpr Samples128 kCornerDistances = corner_distances();

struct TrialLimits {
  float slack, tolerance, exact_from, band_inner, band_outer, core_inner, core_outer;
};

}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// How much errors exceed what is allowed, at most, if the sample is inside or outside; negative where they surely do
// not.
// @return whether each may be good on some side
bool excesses(const OctantTrial& trial, const Samples128& interpolated, const Samples128& surest,
              const TrialLimits& limits, Samples128& inner, Samples128& outer) {
  constexpr hn::CappedTag<float, 16> f32;
  const auto all = [&](float value) HWY_ATTR { return hn::Set(f32, value); };
  const auto zero = hn::Zero(f32);
  const auto good = all(-1);
  auto worst = good;
  for (std::size_t n = 0; n < inner.size(); n += hn::Lanes(f32)) {
    const auto distance = hn::Min(hn::LoadU(f32, trial.distance.data() + n), all(trial.reach));
    const auto least = hn::Sub(distance, all(limits.slack));
    const auto gap = hn::Mul(all(trial.step), hn::LoadU(f32, kCornerDistances.data() + n));
    const auto sure = hn::LoadU(f32, surest.data() + n);
    // 0 where the side is not known.
    const auto side = hn::IfThenElseZero(hn::Gt(hn::Add(least, hn::Abs(sure)), gap), sure);
    const auto excess = [&](decltype(least) error, float core, float band) HWY_ATTR {
      const auto beyond_core =
          hn::Add(all(limits.tolerance), hn::Mul(all(float(kErrorGrowth)), hn::Sub(least, all(core))));
      const auto limit = hn::IfThenElse(hn::Gt(least, all(core)), beyond_core, all(limits.exact_from));
      return hn::IfThenElse(hn::Gt(least, all(band)), good, hn::Sub(hn::Add(error, all(limits.slack)), limit));
    };
    const auto v = hn::LoadU(f32, interpolated.data() + n);
    const auto as_inner = excess(hn::Abs(hn::Sub(v, distance)), limits.core_inner, limits.band_inner);
    const auto as_outer = excess(hn::Abs(hn::Add(v, distance)), limits.core_outer, limits.band_outer);
    const auto is_new = hn::Gt(gap, zero);
    const auto if_inner = hn::IfThenElse(hn::AndNot(hn::Lt(side, zero), is_new), as_inner, good);
    const auto if_outer = hn::IfThenElse(hn::AndNot(hn::Gt(side, zero), is_new), as_outer, good);
    hn::StoreU(if_inner, f32, inner.data() + n);
    hn::StoreU(if_outer, f32, outer.data() + n);
    worst = hn::Max(worst, hn::Min(if_inner, if_outer));
  }
  return hn::AllTrue(f32, hn::Lt(worst, zero));
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(excesses);
}

bool surely_interpolates(const OctantTrial& trial, const FieldTolerance& tolerance_vx, double noted,
                         const std::function<bool(std::size_t)>& is_inside) {
  using detail::Samples128;
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
  using namespace detail;  // Highway's macros take names without a namespace
  const TrialLimits limits{slack,
                           static_cast<float>(tolerance_vx.error),
                           static_cast<float>(std::min(noted, tolerance_vx.error)),
                           static_cast<float>(tolerance_vx.band_inner),
                           static_cast<float>(tolerance_vx.band_outer),
                           static_cast<float>(tolerance_vx.band_inner - kHalfDiagonal),
                           static_cast<float>(tolerance_vx.band_outer - kHalfDiagonal)};
  Samples128 inner;
  Samples128 outer;
  if (!HWY_DYNAMIC_DISPATCH(excesses)(trial, interpolated, surest, limits, inner, outer)) return false;
  // The side matters where the error is only small enough on one of them.
  for (std::size_t n = 0; n < inner.size(); ++n) {
    if (std::max(inner[n], outer[n]) < 0) continue;
    if (!((is_inside(n) ? inner[n] : outer[n]) < 0)) return false;
  }
  return true;
}

}  // namespace vps::bake
#endif

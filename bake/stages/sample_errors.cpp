// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Every operation is rounded by itself.
#include "bake/stages/sample_errors.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/sample_errors.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void compare(const BrickValues& interpolated, const BrickValues& exact, const AllowedError& allowed, double noted,
             SampleErrors& errors) {
  constexpr hn::CappedTag<double, 8> f64;
  const auto all = [&](double value) HWY_ATTR { return hn::Set(f64, value); };
  const auto zero = hn::Zero(f64);
  auto least_spare = all(std::numeric_limits<double>::infinity());
  auto least_hope = least_spare;
  auto most = zero;
  for (std::size_t n = 0; n < exact.size(); n += hn::Lanes(f64)) {
    // The last vector begins earlier, so that it is whole.
    const std::size_t at = std::min(n, exact.size() - hn::Lanes(f64));
    const auto v = hn::LoadU(f64, exact.data() + at);
    const auto is_inner = hn::Gt(v, zero);
    const auto depth = hn::Abs(v);
    const auto beyond_core = hn::Sub(depth, hn::IfThenElse(is_inner, all(allowed.core_inner), all(allowed.core_outer)));
    const auto in_band = hn::Add(all(allowed.error), hn::Mul(all(kErrorGrowth), hn::Max(beyond_core, zero)));
    const auto is_beyond = hn::Gt(depth, hn::IfThenElse(is_inner, all(allowed.band_inner), all(allowed.band_outer)));
    const auto limit = hn::IfThenElse(is_beyond, all(std::numeric_limits<double>::infinity()), in_band);
    const auto error = hn::Abs(hn::Sub(hn::LoadU(f64, interpolated.data() + at), v));
    const auto spare = hn::Sub(limit, error);
    hn::StoreU(error, f64, errors.error.data() + at);
    hn::StoreU(limit, f64, errors.limit.data() + at);
    hn::StoreU(spare, f64, errors.spare.data() + at);
    least_spare = hn::Min(least_spare, spare);
    least_hope = hn::Min(least_hope, hn::Sub(hn::Add(limit, limit), error));
    most = hn::Max(most, error);
  }
  errors.good = hn::AllFalse(f64, hn::Lt(least_spare, zero));
  errors.hopeless = !hn::AllFalse(f64, hn::Lt(least_hope, zero));
  errors.worse = !hn::AllFalse(f64, hn::Gt(most, all(noted)));
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(compare);
}

void compare_samples(const BrickValues& interpolated, const BrickValues& exact, const AllowedError& allowed,
                     double noted, SampleErrors& errors) {
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(compare)(interpolated, exact, allowed, noted, errors);
}

}  // namespace vps::bake
#endif

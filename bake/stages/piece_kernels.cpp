// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Results differ between instruction sets, but only
// within the margin.
#include "bake/stages/piece_kernels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/piece_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_PIECE_KERNELS_COMMON
#define VPS_PIECE_KERNELS_COMMON
namespace vps::bake::detail {
// Places on a triangle that part its edges into equal steps, as weights of the first two corners. The last is repeated.
inline constexpr int kSteps = 8;
inline constexpr std::size_t kPlaces = 48;
struct Places {
  alignas(64) std::array<float, kPlaces> first, second;
};
constexpr Places places_on_triangle() {
  Places places{};
  std::size_t n = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; i + j <= kSteps; ++j, ++n) {
      places.first[n] = static_cast<float>(i) / kSteps;
      places.second[n] = static_cast<float>(j) / kSteps;
    }
  }
  for (; n < kPlaces; ++n) {
    places.first[n] = 1;
    places.second[n] = 0;
  }
  return places;
}
inline constexpr Places kPlacesOnTriangle = places_on_triangle();
}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, 16> float_lanes;
using FloatLanes = hn::Vec<decltype(float_lanes)>;

// Whether all places are nearer to a sample than the root of `most`, where squared distances are multiplied by `unit`.
bool all_places_within(std::span<const NearSamples::Found> samples, const std::array<double, 3>& edges, double unit,
                       float most) {
  const auto all = [&](double value) HWY_ATTR { return hn::Set(float_lanes, static_cast<float>(value * unit)); };
  const FloatLanes edge[3] = {all(edges[0]), all(edges[1]), all(edges[2])};
  for (std::size_t i = 0; i < kPlaces; i += hn::Lanes(float_lanes)) {
    const FloatLanes a = hn::Load(float_lanes, kPlacesOnTriangle.first.data() + i);
    const FloatLanes b = hn::Load(float_lanes, kPlacesOnTriangle.second.data() + i);
    const FloatLanes c = hn::Sub(hn::Sub(hn::Set(float_lanes, 1.0F), a), b);
    FloatLanes least = hn::Set(float_lanes, std::numeric_limits<float>::infinity());
    for (const NearSamples::Found& found : samples) {
      const CornerDistances& s = found.squared;
      least = hn::Min(least, hn::MulAdd(a, all(s[0]), hn::MulAdd(b, all(s[1]), hn::Mul(c, all(s[2])))));
    }
    const FloatLanes curved =
        hn::MulAdd(hn::Mul(a, b), edge[0], hn::MulAdd(hn::Mul(b, c), edge[1], hn::Mul(hn::Mul(c, a), edge[2])));
    if (!hn::AllTrue(float_lanes, hn::Lt(hn::Sub(least, curved), hn::Set(float_lanes, most)))) return false;
  }
  return true;
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(all_places_within);
}  // namespace detail

bool surely_covered(std::span<const NearSamples::Found> samples, const std::array<double, 3>& edges, double limit) {
  using namespace detail;
  const double unit = 1 / limit;
  // No place of the piece is farther from the nearest of those tested than an equilateral triangle's centre is from its
  // corners.
  const double step = std::sqrt(*std::max_element(edges.begin(), edges.end()) * unit / 3) / kSteps;
  // Above `kLeast` no edge is longer than 7, and squared distances that matter are below 100: the float's errors
  // are below 1e-4, far less than the margin.
  constexpr double kMargin = 1e-3;
  constexpr double kLeast = 0.5;
  const double most = 1 - kMargin - step;
  if (!(most > kLeast)) return false;
  return HWY_DYNAMIC_DISPATCH(all_places_within)(samples, edges, unit, static_cast<float>(most * most));
}

}  // namespace vps::bake
#endif

// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/fields/linear_brick.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/fields/linear_brick.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <array>

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using F = hn::Vec<Floats>;

constexpr std::uint32_t kSamples = kFieldEdge * kFieldEdge * kFieldEdge;
// Places of the samples, and of the unused numbers up to the brick's stride.
constexpr auto kPlaces = [] {
  std::array<std::array<float, kFieldStride>, 3> places{};
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    places[0][i] = static_cast<float>(i % kFieldEdge);
    places[1][i] = static_cast<float>(i / kFieldEdge % kFieldEdge);
    places[2][i] = static_cast<float>(i / (kFieldEdge * kFieldEdge));
  }
  return places;
}();

HWY_INLINE F at(const LineOverBrick& line, std::uint32_t i) {
  const Floats f32;
  const auto along = [&](std::size_t axis) {
    return hn::Mul(hn::Set(f32, line.slope[axis]), hn::LoadU(f32, kPlaces[axis].data() + i));
  };
  return hn::Add(hn::Add(hn::Set(f32, line.first), along(0)), hn::Add(along(1), along(2)));
}

template <class Code>
bool is_linear_here(const Code* codes, float step, const LineOverBrick& wanted, float tolerance,
                    const LineOverBrick& height, float near) {
  const Floats f32;
  const hn::Rebind<Code, Floats> narrow;
  const hn::RebindToSigned<Floats> i32;
  // The caller's test of single samples rounds otherwise: what is accepted here, it accepts too.
  const F most = hn::Set(f32, tolerance * (1 - 1e-3F));
  for (std::uint32_t i = 0; i < kSamples; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    const auto counts = hn::And(hn::FirstN(f32, kSamples - i), hn::Le(hn::Abs(at(height, i)), hn::Set(f32, near)));
    const F v = hn::Mul(hn::Set(f32, step), hn::ConvertTo(f32, hn::PromoteTo(i32, hn::LoadU(narrow, codes + i))));
    const auto beyond = hn::And(counts, hn::Not(hn::Le(hn::Abs(hn::Sub(v, at(wanted, i))), most)));
    if (!hn::AllFalse(f32, beyond)) return false;
  }
  return true;
}
bool is_linear_8(const std::int8_t* codes, float step, const LineOverBrick& wanted, float tolerance,
                 const LineOverBrick& height, float near) {
  return is_linear_here(codes, step, wanted, tolerance, height, near);
}
bool is_linear_16(const std::int16_t* codes, float step, const LineOverBrick& wanted, float tolerance,
                  const LineOverBrick& height, float near) {
  return is_linear_here(codes, step, wanted, tolerance, height, near);
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(is_linear_8);
HWY_EXPORT(is_linear_16);

bool is_linear_brick(const VoxelmapView& map, std::size_t sample, float step, const LineOverBrick& wanted,
                     float tolerance, const LineOverBrick& height, float near) noexcept {
  if (map.element == ElementType::i8) {
    const auto* const codes = static_cast<const std::int8_t*>(map.values) + sample;
    return HWY_DYNAMIC_DISPATCH(is_linear_8)(codes, step, wanted, tolerance, height, near);
  }
  const auto* const codes = static_cast<const std::int16_t*>(map.values) + sample;
  return HWY_DYNAMIC_DISPATCH(is_linear_16)(codes, step, wanted, tolerance, height, near);
}

}  // namespace vps::detail
#endif

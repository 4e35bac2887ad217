// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/fields/linear_brick.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/fields/linear_brick.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using F = hn::Vec<Floats>;

// Places of the samples.
constexpr auto kPlaces = [] {
  std::array<std::array<float, kFieldSamples>, 3> places{};
  for (std::uint32_t i = 0; i < kFieldSamples; ++i) {
    places[0][i] = static_cast<float>(i % kFieldEdge);
    places[1][i] = static_cast<float>(i / kFieldEdge % kFieldEdge);
    const std::uint32_t slice = i / kFieldSlice;
    places[2][i] = static_cast<float>(slice);
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
HWY_INLINE bool are_linear(std::span<const Code> codes, float step, const LineOverBrick& wanted, float tolerance,
                           const LineOverBrick& height, float near) {
  const Floats f32;
  const hn::Rebind<Code, Floats> narrow;
  const hn::RebindToSigned<Floats> i32;
  // The caller's test of single samples rounds otherwise: what is accepted here, it accepts too.
  const F most = hn::Set(f32, tolerance * (1 - 1e-3F));
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
  const auto count = static_cast<std::uint32_t>(codes.size());
  auto any_beyond = hn::FirstN(f32, 0);
  for (std::uint32_t next = 0; next < count; next += lanes) {
    const std::uint32_t i = std::min(next, count - lanes);
    const auto counts = hn::Le(hn::Abs(at(height, i)), hn::Set(f32, near));
    const F v =
        hn::Mul(hn::Set(f32, step), hn::ConvertTo(f32, hn::PromoteTo(i32, hn::LoadU(narrow, codes.data() + i))));
    const auto beyond = hn::And(counts, hn::Not(hn::Le(hn::Abs(hn::Sub(v, at(wanted, i))), most)));
    any_beyond = hn::Or(any_beyond, beyond);
  }
  return hn::AllFalse(f32, any_beyond);
}

// Seen from another slice than the first.
HWY_INLINE LineOverBrick from_slice(LineOverBrick line, float slice) {
  line.first += slice * line.slope[2];
  return line;
}

// @param wanted, height  over the slices that are stored
template <class Code>
bool is_linear_here(std::span<const Code> codes, float step, const LineOverBrick& wanted, float tolerance,
                    const LineOverBrick& height, float near, const LeftOut& left_out) {
  if (!are_linear(codes, step, wanted, tolerance, height, near)) return false;
  if (left_out.are_far) return true;
  // Slices that are left out have the samples of the last stored one. What these are off by changes evenly from slice
  // to slice, so that the first and the last of them have the most.
  const std::size_t slices = codes.size() / kFieldSlice;
  const float end = left_out.is_lower ? 0 : static_cast<float>(slices - 1);
  const float last = left_out.is_lower ? -left_out.count : end + left_out.count;
  const std::span<const Code> slice = left_out.is_lower ? codes.first(kFieldSlice) : codes.last(kFieldSlice);
  const float reach = near + left_out.count * std::abs(height.slope[2]);
  for (const float there : {end, last}) {
    if (!are_linear(slice, step, from_slice(wanted, there), tolerance, from_slice(height, there), reach)) return false;
  }
  return true;
}
bool is_linear_8(std::span<const std::int8_t> codes, float step, const LineOverBrick& wanted, float tolerance,
                 const LineOverBrick& height, float near, const LeftOut& left_out) {
  return is_linear_here(codes, step, wanted, tolerance, height, near, left_out);
}
bool is_linear_16(std::span<const std::int16_t> codes, float step, const LineOverBrick& wanted, float tolerance,
                  const LineOverBrick& height, float near, const LeftOut& left_out) {
  return is_linear_here(codes, step, wanted, tolerance, height, near, left_out);
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(is_linear_8);
HWY_EXPORT(is_linear_16);

namespace {

// Over the slices that are stored, which follow each other along z.
LineOverBrick over_stored(const LineOverBrick& line, const octree::Slices& slices) {
  LineOverBrick out = line;
  out.first += static_cast<float>(slices.first) * line.slope[slices.axis];
  std::swap(out.slope[slices.axis], out.slope[2]);
  return out;
}

// Whether no sample of the slices that are left out is near the plane.
bool left_out_are_far(const octree::Slices& slices, const LineOverBrick& height, float near) {
  if (slices.count == kFieldEdge) return true;
  const auto left_out = static_cast<float>(kFieldEdge - slices.count);
  float centre[3] = {2, 2, 2};
  float half[3] = {2, 2, 2};
  half[slices.axis] = 0.5F * (left_out - 1);
  centre[slices.axis] = slices.first > 0 ? half[slices.axis] : kFieldEdge - 1 - half[slices.axis];
  float at_centre = height.first;
  float reach = near;
  for (int axis = 0; axis < 3; ++axis) {
    at_centre += centre[axis] * height.slope[axis];
    reach += half[axis] * std::abs(height.slope[axis]);
  }
  return std::abs(at_centre) > reach;
}

}  // namespace

bool is_linear_brick(const VoxelmapView& map, std::uint32_t entry, float step, const LineOverBrick& wanted,
                     float tolerance, const LineOverBrick& height, float near) noexcept {
  const octree::Slices slices = octree::slices_of(entry);
  const LeftOut left_out{static_cast<float>(kFieldEdge - slices.count), slices.first > 0,
                         left_out_are_far(slices, height, near)};
  const LineOverBrick v = over_stored(wanted, slices);
  const LineOverBrick above = over_stored(height, slices);
  const std::size_t first = std::size_t{octree::slice_of(entry)} * kFieldSlice;
  const std::size_t count = std::size_t{slices.count} * kFieldSlice;
  if (map.element == ElementType::i8) {
    const std::span codes(static_cast<const std::int8_t*>(map.values) + first, count);
    return HWY_DYNAMIC_DISPATCH(is_linear_8)(codes, step, v, tolerance, above, near, left_out);
  }
  const std::span codes(static_cast<const std::int16_t*>(map.values) + first, count);
  return HWY_DYNAMIC_DISPATCH(is_linear_16)(codes, step, v, tolerance, above, near, left_out);
}

}  // namespace vps::detail
#endif

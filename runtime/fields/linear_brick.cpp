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
#include <utility>

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;

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

// Fills the rows for slices along an axis, which takes the place of z.
void fill_rows(BrickTest& test, std::uint32_t axis) {
  const Floats f32;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
  BrickTest::Rows& rows = test.rows[axis];
  const auto fill = [&](const float(&slope)[3], float(&row)[kFieldSamples]) {
    float along[3] = {slope[0], slope[1], slope[2]};
    std::swap(along[axis], along[2]);
    for (std::uint32_t next = 0; next < kFieldSamples; next += lanes) {
      const std::uint32_t i = std::min(next, kFieldSamples - lanes);
      const auto change = [&](std::size_t k) {
        return hn::Mul(hn::Set(f32, along[k]), hn::LoadU(f32, kPlaces[k].data() + i));
      };
      hn::StoreU(hn::Add(hn::Add(change(0), change(1)), change(2)), f32, row + i);
    }
  };
  fill(test.wanted, rows.wanted);
  fill(test.height, rows.height);
  const float* const row = rows.height;
  const auto [lowest, highest] =
      std::minmax({row[0], row[kFieldEdge - 1], row[kFieldSlice - kFieldEdge], row[kFieldSlice - 1]});
  rows.lowest = lowest;
  rows.highest = highest;
  test.has_rows[axis] = true;
}

// The samples of a slice are compared a vector at a time, the last ones with some before them again.
// @param codes  of the slices that are stored
template <class Code>
bool is_linear_here(const Code* codes, const octree::Slices& slices, const BrickTest& test, float wanted,
                    float height) {
  const Floats f32;
  const hn::Rebind<Code, Floats> narrow;
  const hn::RebindToSigned<Floats> i32;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
  const BrickTest::Rows& rows = test.rows[slices.axis];
  const float along = test.height[slices.axis];
  // Slices that are left out have the samples of the nearest one. Where they follow each other along the plane, what
  // they are off by changes evenly, and the last of them has the most.
  const float change = static_cast<float>(kFieldEdge - slices.count) * std::abs(along);
  const bool is_along = change <= 0.01F * test.near;
  const float near = is_along ? test.near + change : test.near;
  const auto step = hn::Set(f32, test.step);
  // The caller's test of single samples rounds otherwise: what is accepted here, it accepts too.
  const auto most = hn::Set(f32, test.tolerance * (1 - 1e-3F));
  const auto first_wanted = hn::Set(f32, wanted);
  const auto first_height = hn::Set(f32, height);
  auto any_beyond = hn::FirstN(f32, 0);
  for (std::uint32_t slice = 0; slice < kFieldEdge; ++slice) {
    const std::uint32_t stored = std::clamp(slice, slices.first, slices.first + slices.count - 1);
    if (is_along && stored != slice && slice % (kFieldEdge - 1) != 0) continue;
    const float at = height + static_cast<float>(slice) * along;
    if (at + rows.lowest > near || at + rows.highest < -near) continue;
    const Code* const samples = codes + (stored - slices.first) * kFieldSlice;
    for (std::uint32_t next = 0; next < kFieldSlice; next += lanes) {
      const std::uint32_t i = std::min(next, kFieldSlice - lanes);
      const std::uint32_t row = slice * kFieldSlice + i;
      const auto v = hn::Mul(step, hn::ConvertTo(f32, hn::PromoteTo(i32, hn::LoadU(narrow, samples + i))));
      const auto off = hn::Sub(v, hn::Add(first_wanted, hn::LoadU(f32, rows.wanted + row)));
      const auto above = hn::Add(first_height, hn::LoadU(f32, rows.height + row));
      const auto counts = hn::Le(hn::Abs(above), hn::Set(f32, near));
      any_beyond = hn::Or(any_beyond, hn::And(counts, hn::Not(hn::Le(hn::Abs(off), most))));
    }
  }
  return hn::AllFalse(f32, any_beyond);
}

template <class Code>
bool is_below_here(const Code* codes, const octree::Slices& slices, const BrickTest& test, float wanted, float floor) {
  const Floats f32;
  const hn::Rebind<Code, Floats> narrow;
  const hn::RebindToSigned<Floats> i32;
  const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
  const BrickTest::Rows& rows = test.rows[slices.axis];
  const auto step = hn::Set(f32, test.step);
  const auto first_wanted = hn::Set(f32, wanted + test.tolerance);
  const auto least = hn::Set(f32, floor + test.tolerance);
  auto any_above = hn::FirstN(f32, 0);
  for (std::uint32_t slice = 0; slice < kFieldEdge; ++slice) {
    const std::uint32_t stored = std::clamp(slice, slices.first, slices.first + slices.count - 1);
    const Code* const samples = codes + (stored - slices.first) * kFieldSlice;
    for (std::uint32_t next = 0; next < kFieldSlice; next += lanes) {
      const std::uint32_t i = std::min(next, kFieldSlice - lanes);
      const auto v = hn::Mul(step, hn::ConvertTo(f32, hn::PromoteTo(i32, hn::LoadU(narrow, samples + i))));
      const auto most = hn::Add(first_wanted, hn::LoadU(f32, rows.wanted + slice * kFieldSlice + i));
      any_above = hn::Or(any_above, hn::Not(hn::Le(v, hn::Max(most, least))));
    }
  }
  return hn::AllFalse(f32, any_above);
}

// Asks a function of a brick's codes and slices.
template <class Ask>
bool ask_brick(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, const Ask& ask) {
  const octree::Slices slices = octree::slices_of(entry);
  if (!test.has_rows[slices.axis]) fill_rows(test, slices.axis);
  const std::size_t first = std::size_t{octree::slice_of(entry)} * kFieldSlice;
  if (map.element == ElementType::i8) return ask(static_cast<const std::int8_t*>(map.values) + first, slices);
  return ask(static_cast<const std::int16_t*>(map.values) + first, slices);
}

bool is_linear(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted, float height) {
  return ask_brick(map, entry, test, [&](const auto* codes, const octree::Slices& slices) {
    return is_linear_here(codes, slices, test, wanted, height);
  });
}
bool is_below(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted, float floor) {
  return ask_brick(map, entry, test, [&](const auto* codes, const octree::Slices& slices) {
    return is_below_here(codes, slices, test, wanted, floor);
  });
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(is_linear);
HWY_EXPORT(is_below);

bool is_linear_brick(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted,
                     float height) noexcept {
  return HWY_DYNAMIC_DISPATCH(is_linear)(map, entry, test, wanted, height);
}

bool is_brick_below(const VoxelmapView& map, std::uint32_t entry, BrickTest& test, float wanted, float floor) noexcept {
  return HWY_DYNAMIC_DISPATCH(is_below)(map, entry, test, wanted, floor);
}

}  // namespace vps::detail
#endif

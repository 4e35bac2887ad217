// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time.
#include "bake/stages/chord_errors.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/chord_errors.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, 16> f32;
using F = hn::Vec<decltype(f32)>;

HWY_INLINE F bend(const float (*values)[ChordLines::kLines], int at, int line) {
  const F before = hn::Load(f32, values[at - 1] + line);
  const F here = hn::Load(f32, values[at] + line);
  const F after = hn::Load(f32, values[at + 1] + line);
  return hn::Add(hn::Sub(before, here), hn::Sub(after, here));
}

HWY_INLINE F chord_error(F before, F a, F b, F after) {
  const F zero = hn::Zero(f32);
  const F eighth = hn::Set(f32, 0.125F);
  const F first = hn::IfThenElse(hn::IsNaN(a), b, a);
  const F last = hn::IfThenElse(hn::IsNaN(b), a, b);
  // Bends of opposite signs are a wave: an eighth of the larger one.
  const F size_first = hn::Abs(first);
  const F size_last = hn::Abs(last);
  const F wave = hn::Mul(eighth, hn::IfThenElse(hn::Gt(size_first, size_last), first, last));
  const auto same_way = hn::Gt(hn::Mul(first, last), zero);
  const auto in_common = [&](F beyond) {
    return hn::IfThenElseZero(hn::Gt(hn::Mul(beyond, first), zero), hn::Abs(beyond));
  };
  const F curve = hn::Min(hn::Min(size_first, size_last), hn::Min(in_common(before), in_common(after)));
  const F x = hn::Sub(size_first, curve);
  const F y = hn::Sub(size_last, curve);
  const F sum = hn::Add(x, y);
  const F crease = hn::IfThenElseZero(hn::Gt(sum, zero), hn::Div(hn::Mul(x, y), sum));
  const F size = hn::Add(hn::Mul(eighth, curve), crease);
  const F error = hn::IfThenElse(same_way, hn::CopySignToAbs(size, first), wave);
  return hn::IfThenElse(hn::IsNaN(error), zero, error);
}

void errors_of_lines(ChordLines& lines) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto* const values = lines.value[axis];
    for (int line = 0; line < ChordLines::kLines; line += static_cast<int>(hn::Lanes(f32))) {
      F before = bend(values, 1, line);
      F a = bend(values, 2, line);
      F b = bend(values, 3, line);
      for (int chord = 0; chord <= ChordLines::kSide; ++chord) {
        const F after = bend(values, chord + 4, line);
        hn::Store(chord_error(before, a, b, after), f32, lines.error[axis][chord] + line);
        before = a;
        a = b;
        b = after;
      }
    }
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(errors_of_lines);
}

void chord_errors(ChordLines& lines) {
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(errors_of_lines)(lines);
}

}  // namespace vps::bake
#endif

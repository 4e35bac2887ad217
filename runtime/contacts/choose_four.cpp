// SPDX-License-Identifier: Zlib
// Chooses the contacts of a manifold among thousands: a flat face touches with all of its points. Compiled once per
// instruction set by Highway, chosen at run time. Paper: Sec. 3.2.
#include "runtime/contacts/choose_four.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/contacts/choose_four.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <limits>

#include "runtime/fields/field_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// Factor by which a new contact must be better than one of the last step.
constexpr float kHysteresis = 1.2F;

HWY_INLINE Points points_at(Vec3 p) {
  return {set(p.x), set(p.y), set(p.z)};
}
HWY_INLINE Points minus(const Points& a, const Points& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE F dot_of(const Points& a, const Points& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}
HWY_INLINE Points cross_of(const Points& a, const Points& b) {
  return {hn::MulSub(a.y, b.z, hn::Mul(a.z, b.y)), hn::MulSub(a.z, b.x, hn::Mul(a.x, b.z)),
          hn::MulSub(a.x, b.y, hn::Mul(a.y, b.x))};
}

class Candidates {
 public:
  Candidates(const ContactRows& rows, std::span<const std::uint32_t> previous, float alike)
      : rows_(rows), previous_(previous), alike_(alike) {}

  [[nodiscard]] Vec3 position(std::uint32_t i) const {
    return {rows_.position[0][i], rows_.position[1][i], rows_.position[2][i]};
  }

  // The deepest. Of contacts that are equally deep, one of the step before.
  std::uint32_t deepest() const {
    std::uint32_t at = 0;
    (void)first_of_largest(
        std::numeric_limits<float>::lowest(),
        [&](std::uint32_t i, F penetration) {
          return hn::IfThenElse(was_chosen(i), hn::Add(penetration, set(alike_)), penetration);
        },
        at);
    return at;
  }

  // Sets `at` to the first contact with the largest score above 0; false if there is none.
  // @param taken  contacts that were chosen before: rounding may leave them a score
  template <class Score>
  bool best(const Score& score, std::span<const std::uint32_t> taken, std::uint32_t& at) const {
    return first_of_largest(
        0.0F,
        [&](std::uint32_t i, F penetration) {
          const Points p = {hn::LoadU(f32, rows_.position[0] + i), hn::LoadU(f32, rows_.position[1] + i),
                            hn::LoadU(f32, rows_.position[2] + i)};
          const F s = hn::IfThenZeroElse(is_one_of(taken, numbers_from(i)), hn::Mul(score(p), weight(penetration)));
          return hn::IfThenElse(was_chosen(i), hn::Mul(s, set(kHysteresis)), s);
        },
        at);
  }

 private:
  static M is_one_of(std::span<const std::uint32_t> numbers, hn::Vec<Words> lanes) {
    const Words u32;
    auto any = hn::FirstN(u32, 0);
    for (const std::uint32_t number : numbers) any = hn::Or(any, hn::Eq(lanes, hn::Set(u32, number)));
    return hn::RebindMask(f32, any);
  }
  M was_chosen(std::uint32_t i) const { return is_one_of(previous_, hn::LoadU(Words(), rows_.feature + i)); }

  // A point that does not touch yet carries no load, however far out it lies. A body that rests on such points never
  // stops rocking.
  F weight(F penetration) const {
    const M touches = hn::Ge(penetration, hn::Zero(f32));
    if (hn::AllTrue(f32, touches)) return set(1);  // a division costs as much as the rest
    const F squared = set(alike_ * alike_);
    const F off = hn::Div(squared, hn::MulAdd(penetration, penetration, squared));
    return hn::IfThenElse(touches, set(1), off);
  }

  // @return whether a value above `floor` was found
  template <class Value>
  bool first_of_largest(float floor, const Value& value, std::uint32_t& at) const {
    const Words u32;
    F largest = set(floor);
    auto where = hn::Set(u32, rows_.count);
    for (std::uint32_t i = 0; i < rows_.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
      const F v = value(i, hn::LoadU(f32, rows_.penetration + i));
      const M larger = hn::And(hn::FirstN(f32, rows_.count - i), hn::Gt(v, largest));
      largest = hn::IfThenElse(larger, v, largest);
      where = hn::IfThenElse(hn::RebindMask(u32, larger), numbers_from(i), where);
    }
    const F of_all = hn::MaxOfLanes(f32, largest);
    const auto is_largest = hn::RebindMask(u32, hn::Eq(largest, of_all));
    const std::uint32_t first =
        hn::GetLane(hn::MinOfLanes(u32, hn::IfThenElse(is_largest, where, hn::Set(u32, rows_.count))));
    if (first == rows_.count) return false;
    at = first;
    return true;
  }

  const ContactRows& rows_;
  const std::span<const std::uint32_t> previous_;
  const float alike_;
};

std::size_t choose_four_here(const ContactRows& contacts, std::span<const std::uint32_t> previous, float alike,
                             std::array<std::uint32_t, 4>& chosen) {
  if (contacts.count == 0) return 0;
  const Candidates candidates(contacts, previous, alike);
  chosen[0] = candidates.deepest();
  const Vec3 a = candidates.position(chosen[0]);
  const Points at_a = points_at(a);
  const auto far_from_a = [&](const Points& p) {
    const Points way = minus(p, at_a);
    return dot_of(way, way);
  };
  if (!candidates.best(far_from_a, {chosen.data(), 1}, chosen[1])) return 1;
  const Vec3 b = candidates.position(chosen[1]);
  const Points ab = points_at(b - a);
  // Twice the area of the triangle abp.
  const auto far_from_line = [&](const Points& p) {
    const Points area = cross_of(ab, minus(p, at_a));
    return hn::Sqrt(dot_of(area, area));
  };
  if (!candidates.best(far_from_line, {chosen.data(), 2}, chosen[2])) return 2;
  const Vec3 c = candidates.position(chosen[2]);
  const Vec3 n = cross(b - a, c - a);
  const Points normal = points_at(n);
  // Area that a fourth corner adds beyond one of the triangle's edges, times a constant.
  const auto beyond_edge = [&](const Points& p, const Points& from, const Points& edge) {
    return dot_of(cross_of(edge, minus(from, p)), normal);
  };
  const Points at_b = points_at(b);
  const Points at_c = points_at(c);
  const Points bc = points_at(c - b);
  const Points ca = points_at(a - c);
  const auto beyond = [&](const Points& p) {
    return hn::Max(beyond_edge(p, at_a, ab), hn::Max(beyond_edge(p, at_b, bc), beyond_edge(p, at_c, ca)));
  };
  return candidates.best(beyond, {chosen.data(), 3}, chosen[3]) ? 4 : 3;
}

void keep_deeper_here(float least, ContactRows& contacts) {
  const Words u32;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < contacts.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    const F penetration = hn::LoadU(f32, contacts.penetration + i);
    const M deeper = hn::And(hn::FirstN(f32, contacts.count - i), hn::Gt(penetration, set(least)));
    // A row's packed lanes end before its next ones begin.
    for (float* const row : contacts.position) store_packed(f32, hn::LoadU(f32, row + i), deeper, row + kept);
    store_packed(u32, hn::LoadU(u32, contacts.feature + i), hn::RebindMask(u32, deeper), contacts.feature + kept);
    kept += store_packed(f32, penetration, deeper, contacts.penetration + kept);
  }
  contacts.count = kept;
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(choose_four_here);
std::size_t choose_four(const ContactRows& contacts, std::span<const std::uint32_t> previous, float alike,
                        std::array<std::uint32_t, 4>& chosen) noexcept {
  return HWY_DYNAMIC_DISPATCH(choose_four_here)(contacts, previous, alike, chosen);
}

HWY_EXPORT(keep_deeper_here);
void keep_deeper(float least, ContactRows& contacts) noexcept {
  HWY_DYNAMIC_DISPATCH(keep_deeper_here)(least, contacts);
}

}  // namespace vps::detail
#endif

// SPDX-License-Identifier: Zlib
/// @file The tests of a descent's points, compiled once per instruction set. Internal: see field_lanes-inl.h.
#if defined(VPS_RUNTIME_POINT_TESTS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef VPS_RUNTIME_POINT_TESTS_INL_H_
#undef VPS_RUNTIME_POINT_TESTS_INL_H_
#else
#define VPS_RUNTIME_POINT_TESTS_INL_H_
#endif

#include <algorithm>
#include <limits>

#include "runtime/fields/sampled_lanes-inl.h"
#include "runtime/queries/descend.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// By how much V grows at most on the ways of points.
template <class Lanes>
HWY_INLINE F growth_of(const Lanes& field, const Descent& d, const Points& codes) {
  const Affine& ways = d.moving->ways;
  const F z = row(ways, 2, codes);
  if constexpr (std::is_same_v<Lanes, BelowLanes>) {
    if (d.moving->is_upright) return field.growth(field.place(d.points, codes), z);
  }
  const F x = row(ways, 0, codes);
  const F y = row(ways, 1, codes);
  return hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
}

HWY_INLINE F height_of(const CodeBound& region, const Points& codes) {
  const F z = hn::MulAdd(set(region.normal[2]), codes.z, set(region.height));
  return hn::MulAdd(set(region.normal[0]), codes.x, hn::MulAdd(set(region.normal[1]), codes.y, z));
}

// Whether the planes bound the field's own values wherever these can be hits, and not only the true V.
template <class Lanes>
HWY_INLINE bool planes_bound_hits(const Lanes& field, const Descent& d) {
  return d.contact_distance < field.map.end_outer;
}

// Whether points are tested against the planes before they are looked up.
template <class Lanes>
HWY_INLINE bool takes_planes(const Lanes& field, const Descent& d) {
  if constexpr (Lanes::kHasFarGrid) {
    return field.map.planes != nullptr && (d.moving != nullptr || planes_bound_hits(field, d));
  } else {
    return false;
  }
}
// The plane of the region that is used in their place; null: none.
template <class Lanes>
HWY_INLINE const CodeBound* region_of(const Lanes& field, const Descent& d) {
  return takes_planes(field, d) ? d.region : nullptr;
}

// V at points that were not looked up, as the look-up gives it.
// @param sampled  lanes where the field has samples
template <class Lanes>
HWY_INLINE F value_at(const Lanes& field, const Points& p, const Batch& batch, M valid, M& sampled) {
  if constexpr (Lanes::kHasFarGrid) {
    const auto found = field.look_up(p);
    sampled = found.sampled;
    return field.value_of(p, found);
  } else {
    sampled = valid;
    return field.value(p, batch, valid);
  }
}

// Which points are hits. Beyond the band a look-up gives a value that is no farther from 0 than V: outside an upper
// bound. It suffices for points that are no hits. For others the far grid gives V.
template <class Lanes>
HWY_INLINE M find_hits(const Lanes& field, const Points& p, M sampled, M valid, F limit, F& v) {
  const M hit = hn::And(valid, hn::Ge(v, limit));
  if constexpr (Lanes::kHasFarGrid) {
    if (!hn::AllFalse(f32, hit) && field.map.far != nullptr && !hn::AllFalse(f32, hn::And(hit, field.beyond_band(v)))) {
      v = field.with_far_grid(p, v, sampled);
      return hn::And(valid, hn::Ge(v, limit));
    }
  }
  return hit;
}

// Adds hits to the results.
HWY_INLINE void add_hits(const Points& codes, hn::Vec<Words> points, hn::Vec<Words> leaves, F v, M hit, Descent& d) {
  const Words u32;
  const auto hit_word = hn::RebindMask(u32, hit);
  if (d.positions[0] != nullptr) {
    for (int axis = 0; axis < 3; ++axis) {
      (void)store_packed(f32, row(d.to_positions, axis, codes), hit, d.positions[axis] + d.hit_count);
    }
  }
  (void)store_packed(u32, points, hit_word, d.hits + d.hit_count);
  (void)store_packed(u32, leaves, hit_word, d.leaves + d.hit_count);
  d.hit_count += store_packed(f32, v, hit, d.penetrations + d.hit_count);
}

// Tests points, and adds hits to the results in the order of the points. Points of a map with planes are tested against
// these first. The few that are left wait until they fill a vector, once there are hits two: an octree takes five
// reads, one after the other.
template <class Lanes>
class PointTests {
 public:
  PointTests(const Lanes& field, Descent& d)
      : field_(field),
        d_(d),
        limit_(set(-d.contact_distance)),
        deepest_(set(d.deepest)),
        rejected_(set(d.rejected)),
        has_planes_(takes_planes(field, d)),
        region_(region_of(field, d)),
        nearest_(set(d.hits_only ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::lowest())) {}

  // @param batch  numbers of the points, for fields that need them
  HWY_INLINE void test(const Points& codes, const Batch& batch, hn::Vec<Words> points, hn::Vec<Words> leaves, M valid) {
    if constexpr (Lanes::kHasFarGrid) {
      if (region_ != nullptr) return filter_by_region(codes, points, leaves, valid);
    }
    const Points p = field_.place(d_.points, codes);
    if constexpr (Lanes::kHasFarGrid) {
      if (has_planes_) return filter(codes, p, points, leaves, valid);
    }
    M sampled;
    const F v = value_at(field_, p, batch, valid, sampled);
    take(codes, p, v, sampled, points, leaves, valid);
  }
  // Writes the results, after the last points.
  HWY_INLINE void finish() {
    if constexpr (Lanes::kHasFarGrid) {
      if (count_ > 0) look_up_first(count_);
      take_fetched();
    }
    d_.deepest = hn::GetLane(hn::MaxOfLanes(f32, deepest_));
    d_.rejected = hn::GetLane(hn::MaxOfLanes(f32, rejected_));
  }

 private:
  // Whether V of a point that is no hit may be the result.
  [[nodiscard]] bool seeks_nearest() const { return d_.hit_count == 0 && !d_.hits_only; }

  // The least V of a hit.
  HWY_INLINE F least(const Points& codes) const {
    if (d_.moving == nullptr) return limit_;
    return hn::Max(limit_, hn::Neg(hn::Add(growth_of(field_, d_, codes), set(d_.moving->near))));
  }

  HWY_INLINE void take(const Points& codes, const Points& p, F v, M sampled, hn::Vec<Words> points,
                       hn::Vec<Words> leaves, M valid) {
    const M hit = find_hits(field_, p, sampled, valid, least(codes), v);
    deepest_ = hn::IfThenElse(valid, hn::Max(deepest_, v), deepest_);
    if (!hn::AllFalse(f32, hit)) add_hits(codes, points, leaves, v, hit, d_);
  }

  // Keeps the points that can be hits, and without hits those that can be nearer than all before. Where most can be
  // hits, as on a thread in contact or in a list of remembered points, the planes cost more than they save. What a
  // vector's planes say decides nothing until some vectors later: a branch would have to wait for it.
  HWY_INLINE void filter(const Points& codes, const Points& p, hn::Vec<Words> points, hn::Vec<Words> leaves, M valid) {
    M near = valid;
    const F least_hit = least(codes);
    // Otherwise the planes reject points that a look-up may take for hits.
    if (unfiltered_ > 0 && hn::AllTrue(f32, hn::Gt(least_hit, set(-field_.map.end_outer)))) {
      --unfiltered_;
    } else {
      const F ceiling = field_.ceiling(p).v;
      near = hn::And(valid, hn::Ge(ceiling, hn::Min(least_hit, nearest_)));
      rejected_ = hn::IfThenElse(hn::AndNot(near, valid), hn::Max(rejected_, ceiling), rejected_);
      seen_ += static_cast<std::uint32_t>(hn::CountTrue(f32, valid));
      near_ += static_cast<std::uint32_t>(hn::CountTrue(f32, near));
      if (++filtered_ == kSample) choose_run();
    }
    wait(codes, points, leaves, near);
  }
  // One plane bounds V wherever the shell is, and costs a tenth.
  HWY_INLINE void filter_by_region(const Points& codes, hn::Vec<Words> points, hn::Vec<Words> leaves, M valid) {
    const F ceiling = height_of(*region_, codes);
    M near = hn::And(valid, hn::Ge(ceiling, hn::Min(limit_, nearest_)));
    if (d_.moving != nullptr && !hn::AllFalse(f32, near)) {
      near = hn::And(near, hn::Ge(ceiling, hn::Min(least(codes), nearest_)));
    }
    rejected_ = hn::IfThenElse(hn::AndNot(near, valid), hn::Max(rejected_, ceiling), rejected_);
    if (!hn::AllFalse(f32, near)) wait(codes, points, leaves, near);
  }

  // Lets points wait for their look-up.
  HWY_INLINE void wait(const Points& codes, hn::Vec<Words> points, hn::Vec<Words> leaves, M near) {
    const Words u32;
    (void)store_packed(f32, codes.x, near, codes_[0] + count_);
    (void)store_packed(f32, codes.y, near, codes_[1] + count_);
    (void)store_packed(f32, codes.z, near, codes_[2] + count_);
    (void)store_packed(u32, leaves, hn::RebindMask(u32, near), leaves_ + count_);
    count_ += store_packed(u32, points, hn::RebindMask(u32, near), points_ + count_);
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
    const std::uint32_t some = seeks_nearest() ? lanes : 2 * lanes;
    if (count_ < some) return;
    look_up_first(some);
    if (!d_.hits_only) nearest_ = hn::MaxOfLanes(f32, deepest_);
  }

  // Decides by the last vectors whether the next ones are looked up without the planes.
  void choose_run() {
    const bool are_most = 8 * near_ >= 7 * seen_;
    unfiltered_ = run_ = are_most ? std::clamp(2 * run_, kSample, kLongestRun) : 0;
    filtered_ = seen_ = near_ = 0;
  }

  // Finds the samples of the first waiting points, at most two vectors, and moves the others to the front.
  HWY_NOINLINE void look_up_first(std::uint32_t count) {
    const Words u32;
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
    take_fetched();
    fetched_[0] = waiting(0, count);
    if (count <= lanes) {
      cells_[0] = field_.find_cells(fetched_[0].places);
      field_.fetch(cells_[0]);
      fetched_count_ = 1;
    } else {
      fetched_[1] = waiting(lanes, count - lanes);
      find_cells_together(field_, fetched_[0].places, field_, fetched_[1].places, cells_[0], cells_[1]);
      field_.fetch(cells_[0]);
      field_.fetch(cells_[1]);
      fetched_count_ = 2;
    }
    // Without a hit the next points are compared with these, and fewer are looked up.
    if (seeks_nearest()) take_fetched();
    const std::uint32_t whole = count <= lanes ? lanes : 2 * lanes;
    for (float* const row : {codes_[0], codes_[1], codes_[2]}) hn::Store(hn::Load(f32, row + whole), f32, row);
    for (std::uint32_t* const row : {points_, leaves_}) hn::Store(hn::Load(u32, row + whole), u32, row);
    count_ -= count;
  }

  struct Waiting {
    Points codes, places;
    hn::Vec<Words> points, leaves;
    M valid;
  };
  HWY_INLINE Waiting waiting(std::uint32_t first, std::uint32_t count) const {
    const Words u32;
    const Points codes = {hn::Load(f32, codes_[0] + first), hn::Load(f32, codes_[1] + first),
                          hn::Load(f32, codes_[2] + first)};
    return {codes, field_.place(d_.points, codes), hn::Load(u32, points_ + first), hn::Load(u32, leaves_ + first),
            hn::FirstN(f32, count)};
  }
  // The points that the planes leave, where these reject more than a look-up does.
  HWY_INLINE M below_planes(const Waiting& w) {
    const F least_hit = least(w.codes);
    if (hn::AllTrue(f32, hn::Gt(least_hit, set(-field_.map.end_outer)))) return w.valid;
    const F ceiling = field_.ceiling(w.places).v;
    const M near = hn::And(w.valid, hn::Ge(ceiling, hn::Min(least_hit, nearest_)));
    rejected_ = hn::IfThenElse(hn::AndNot(near, w.valid), hn::Max(rejected_, ceiling), rejected_);
    return near;
  }
  HWY_NOINLINE void take_fetched() {
    for (std::uint32_t n = 0; n < fetched_count_; ++n) {
      const Waiting& w = fetched_[n];
      const auto found = field_.interpolate(cells_[n]);
      const M near = region_ != nullptr ? below_planes(w) : w.valid;
      take(w.codes, w.places, field_.value_of(w.places, found), found.sampled, w.points, w.leaves, near);
    }
    fetched_count_ = 0;
  }

  const Lanes& field_;
  Descent& d_;
  // Points whose samples come from memory while the next ones go down the octree.
  Waiting fetched_[2];
  typename Lanes::Cells cells_[2];
  std::uint32_t fetched_count_ = 0;  // vectors
  const F limit_;
  F deepest_, rejected_;
  const bool has_planes_;
  const CodeBound* const region_;
  F nearest_;  // points below it are of no use, unless they are hits
  static constexpr std::uint32_t kSample = 4, kLongestRun = 16;
  std::uint32_t filtered_ = 0, seen_ = 0, near_ = 0;  // of a sample: vectors, their points, and those near
  std::uint32_t run_ = 0;         // vectors that are looked up without the planes after a sample of which most are near
  std::uint32_t unfiltered_ = 0;  // of these, those to come
  // Room for two vectors that wait, and another.
  std::uint32_t count_ = 0;
  HWY_ALIGN float codes_[3][3 * kLanePadding] = {};
  HWY_ALIGN std::uint32_t points_[3 * kLanePadding] = {};
  HWY_ALIGN std::uint32_t leaves_[3 * kLanePadding] = {};
};

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // toggled guard

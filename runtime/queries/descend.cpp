// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/queries/descend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/queries/descend.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <algorithm>

#include "runtime/fields/sampled_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

HWY_INLINE F way_of(const Affine& ways, const Points& stored) {
  const F x = row(ways, 0, stored);
  const F y = row(ways, 1, stored);
  const F z = row(ways, 2, stored);
  return hn::Sqrt(hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z))));
}

// The spheres of a batch, in the field.
struct Spheres {
  Points centre;
  F radius;
  F reach;  // radius + contact distance
};
template <class Lanes>
HWY_INLINE Spheres spheres_of(const Lanes& field, const Descent& d, const Batch& batch) {
  const Points codes = load_centres(*d.shell, batch);
  const F radius = hn::MulAdd(load_radii(*d.shell, batch), set(d.radius_scale), set(d.slack));
  F distance = set(d.contact_distance);
  if (d.moving != nullptr) {
    const F way = hn::MulAdd(set(d.moving->turn), radius, way_of(d.moving->ways, codes));
    distance = hn::Min(distance, hn::Add(way, set(d.moving->near)));
  }
  return {field.place(d.points, codes), radius, hn::Add(radius, distance)};
}

// Whether spheres and points can be tested against the planes first.
template <class Lanes>
HWY_INLINE bool has_planes(const Lanes& field, const Descent& d) {
  if constexpr (Lanes::kHasFarGrid) {
    // The bounds of nodes that are left must hold inside, too.
    return field.map.planes != nullptr && d.bounds == nullptr;
  } else {
    return false;
  }
}
// Whether the planes bound the field's own values wherever these can be hits, and not only the true V.
template <class Lanes>
HWY_INLINE bool planes_bound_hits(const Lanes& field, const Descent& d) {
  return d.contact_distance < field.map.end_outer;
}

// The field's bound at the centres of spheres.
template <class Lanes>
HWY_INLINE F bound_at(const Lanes& field, const Descent& d, const Spheres& spheres) {
  if constexpr (Lanes::kHasFarGrid) {
    if (has_planes(field, d)) {
      const auto ceiling = field.ceiling(spheres.centre);
      if (!planes_bound_hits(field, d)) return ceiling.v;
      // The sphere's slack has the field's error, which a wide plane does not need.
      const M direct = hn::And(ceiling.wide, hn::Le(spheres.radius, set(1)));
      return hn::IfThenElse(direct, hn::Sub(ceiling.v, set(field.map.error)), ceiling.v);
    }
  }
  return field.bound(spheres.centre, spheres.reach);
}

// Which spheres may touch, from the field's bound at their centres.
HWY_INLINE M touching(const Batch& batch, const Spheres& spheres, F bound) {
  return hn::And(valid_lanes(batch), hn::Ge(hn::Add(bound, spheres.reach), hn::Zero(f32)));
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

template <class Lanes>
bool touches_one(const Lanes& field, Descent& d, std::uint32_t node) {
  const Batch batch{node, 1, 0};
  const Spheres spheres = spheres_of(field, d, batch);
  const F at_centre = field.bound(spheres.centre, spheres.reach);
  const bool touch = !hn::AllFalse(f32, touching(batch, spheres, at_centre));
  const float bound = hn::GetLane(hn::Add(at_centre, spheres.radius));
  if (!touch && bound > d.rejected) d.rejected = bound;
  if (touch && d.bounds != nullptr) d.bounds[0] = bound;
  ++d.nodes_tested;
  return touch;
}

// Tests a batch of spheres. Writes the nodes that may touch, and upper bounds of V below them if there is room for
// these.
// @param rejected  of the others
template <class Lanes>
HWY_INLINE std::uint32_t test_spheres(const Lanes& field, Descent& d, const Batch& batch, F& rejected,
                                      std::uint32_t* out, float* bounds) {
  const Spheres spheres = spheres_of(field, d, batch);
  const F bound = bound_at(field, d, spheres);
  const M touch = touching(batch, spheres, bound);
  const M apart = hn::AndNot(touch, valid_lanes(batch));
  // Upper bounds of V below the spheres, unless they touch: docs/internals/bounds.md.
  const F below = hn::Add(bound, spheres.radius);
  rejected = hn::IfThenElse(apart, hn::Max(rejected, below), rejected);
  if (bounds != nullptr) store_packed(f32, below, touch, bounds);
  d.nodes_tested += batch.count;
  return store_packed(Words(), numbers_of(batch), hn::RebindMask(Words(), touch), out);
}

template <class Lanes>
std::uint32_t touching_lanes(const Lanes& field, Descent& d, IndexRange nodes, std::uint32_t* out) {
  constexpr auto kMost = static_cast<std::uint32_t>(hn::MaxLanes(Floats()));
  F rejected = set(d.rejected);
  std::uint32_t count = 0;
  for (std::uint32_t first = nodes.begin; first < nodes.end; first += kMost) {
    const Batch batch{first, nodes.end - first < kMost ? nodes.end - first : kMost, 0};
    count += test_spheres(field, d, batch, rejected, out + count, nullptr);
  }
  d.rejected = hn::GetLane(hn::MaxOfLanes(f32, rejected));
  return count;
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
        has_planes_(takes_planes()) {}

  // @param batch  numbers of the points, for fields that need them
  HWY_INLINE void test(const Points& codes, const Batch& batch, hn::Vec<Words> points, hn::Vec<Words> leaves, M valid) {
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
  [[nodiscard]] bool takes_planes() const {
    if constexpr (Lanes::kHasFarGrid) {
      return field_.map.planes != nullptr && (d_.moving != nullptr || planes_bound_hits(field_, d_));
    } else {
      return false;
    }
  }

  // The least V of a hit.
  HWY_INLINE F least(const Points& codes) const {
    if (d_.moving == nullptr) return limit_;
    return hn::Max(limit_, hn::Neg(hn::Add(way_of(d_.moving->ways, codes), set(d_.moving->near))));
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
    const Words u32;
    (void)store_packed(f32, codes.x, near, codes_[0] + count_);
    (void)store_packed(f32, codes.y, near, codes_[1] + count_);
    (void)store_packed(f32, codes.z, near, codes_[2] + count_);
    (void)store_packed(u32, leaves, hn::RebindMask(u32, near), leaves_ + count_);
    count_ += store_packed(u32, points, hn::RebindMask(u32, near), points_ + count_);
    const auto lanes = static_cast<std::uint32_t>(hn::Lanes(f32));
    const std::uint32_t some = d_.hit_count == 0 ? lanes : 2 * lanes;
    if (count_ < some) return;
    look_up_first(some);
    nearest_ = hn::MaxOfLanes(f32, deepest_);
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
    if (d_.hit_count == 0) take_fetched();
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
  HWY_NOINLINE void take_fetched() {
    for (std::uint32_t n = 0; n < fetched_count_; ++n) {
      const Waiting& w = fetched_[n];
      const auto found = field_.interpolate(cells_[n]);
      take(w.codes, w.places, field_.value_of(w.places, found), found.sampled, w.points, w.leaves, w.valid);
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
  F nearest_ = set(std::numeric_limits<float>::lowest());
  const bool has_planes_;
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

// Returns the children of a queue's nodes in batches.
class Batches {
 public:
  Batches(Descent& d, std::uint32_t head) : d_(d), head_(head) {}

  // Gets the next batch of a node with a number below `last`, if the queue up to `tail` has one.
  HWY_INLINE bool next(std::uint32_t tail, std::uint32_t last, Batch& batch) {
    if (left_ == 0) {
      do {
        if (head_ >= tail || head_ >= d_.stop || d_.queue[head_] >= last) return false;
        parent_ = d_.queue[head_++];
      } while (d_.flats != nullptr && set_aside(parent_));
      const IndexRange children = children_of(*d_.shell, parent_);
      first_ = children.begin;
      left_ = children.end - children.begin;
    }
    constexpr auto kMost = static_cast<std::uint32_t>(hn::MaxLanes(Floats()));
    batch = {first_, left_ < kMost ? left_ : kMost, parent_};
    first_ += batch.count;
    left_ -= batch.count;
    return true;
  }
  [[nodiscard]] std::uint32_t head() const { return head_; }

 private:
  bool set_aside(std::uint32_t node) {
    const std::uint32_t* const offsets = d_.shell->hull_offsets + node;
    if (offsets[0] == offsets[1]) return false;
    d_.flats[d_.flat_count++] = node;
    return true;
  }

  Descent& d_;
  std::uint32_t head_;
  std::uint32_t first_ = 0, left_ = 0, parent_ = 0;
};

template <class Lanes>
void descend_lanes(const Lanes& field, Descent& d) {
  const Words u32;
  const std::uint32_t leaves = d.shell->level_offsets[d.shell->levels - 1];
  const std::uint32_t last_inner = leaves < d.last_node ? leaves : d.last_node;
  F rejected = set(d.rejected);
  Batches batches(d, d.begin);
  std::uint32_t tail = d.end;
  Batch batch;
  while (batches.next(tail, last_inner, batch)) {
    tail += test_spheres(field, d, batch, rejected, d.queue + tail, d.bounds != nullptr ? d.bounds + tail : nullptr);
  }
  d.rejected = hn::GetLane(hn::MaxOfLanes(f32, rejected));
  // After the inner nodes the queue has only leaves.
  PointTests<Lanes> tests(field, d);
  while (batches.next(tail, d.last_node, batch)) {
    tests.test(load_points(*d.shell, batch), batch, numbers_of(batch), hn::Set(u32, batch.parent), valid_lanes(batch));
    d.points_tested += batch.count;
  }
  tests.finish();
  d.begin = batches.head();
  d.end = tail;
}

HWY_INLINE Points listed_codes(const PointList& list, std::uint32_t first) {
  return {hn::LoadU(f32, list.codes[0] + first), hn::LoadU(f32, list.codes[1] + first),
          hn::LoadU(f32, list.codes[2] + first)};
}

template <class Lanes>
void test_list_lanes(const Lanes& field, Descent& d, const PointList& list) {
  const Words u32;
  PointTests<Lanes> tests(field, d);
  for (std::uint32_t i = 0; i < list.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    M wanted = hn::FirstN(f32, list.count - i);
    if (list.ways != nullptr) {
      wanted = hn::And(wanted, hn::Le(hn::LoadU(f32, list.ways + i), set(list.moved)));
      if (hn::AllFalse(f32, wanted)) continue;
    }
    d.points_tested += static_cast<std::uint32_t>(hn::CountTrue(f32, wanted));
    tests.test(listed_codes(list, i), Batch(), hn::LoadU(u32, list.points + i), hn::LoadU(u32, list.leaves + i),
               wanted);
  }
  tests.finish();
}

template <class Lanes>
void measure_ways_lanes(const Lanes& field, const Descent& d, const PointList& list, float jump, float* ways) {
  for (std::uint32_t i = 0; i < list.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    const F gap = hn::Neg(hn::Add(hn::LoadU(f32, d.penetrations + i), set(d.contact_distance)));
    F way = hn::Sub(gap, set(jump));
    if constexpr (Lanes::kHasFarGrid) {
      way = hn::Max(way, field.way_in_brick(field.look_up(field.place(d.points, listed_codes(list, i))), gap, jump));
    }
    hn::StoreU(way, f32, ways + i);
  }
}

template <class Lanes>
void test_parents_lanes(const Lanes& field, Descent& d, std::uint32_t from, std::uint32_t to) {
  const Words u32;
  // One point at a time for fields that need the point's number.
  const std::size_t most = std::is_same_v<Lanes, PlainLanes> ? 1 : hn::Lanes(f32);
  PointTests<Lanes> tests(field, d);
  d.points_tested += to - from;
  while (from < to) {
    const auto count = static_cast<std::uint32_t>(to - from < most ? to - from : most);
    HWY_ALIGN float codes[3][kLanePadding] = {};
    HWY_ALIGN std::uint32_t points[kLanePadding] = {};
    for (std::uint32_t lane = 0; lane < count; ++lane) {
      points[lane] = d.shell->parent_point[d.queue[from + lane]];
      for (int axis = 0; axis < 3; ++axis) codes[axis][lane] = d.shell->position[axis][points[lane]];
    }
    const Points stored = {hn::Load(f32, codes[0]), hn::Load(f32, codes[1]), hn::Load(f32, codes[2])};
    tests.test(stored, Batch{points[0], count, 0}, hn::Load(u32, points), hn::LoadU(u32, d.queue + from),
               hn::FirstN(f32, count));
    from += count;
  }
  tests.finish();
}

// The loops with a type-erased field.
template <class Field>
struct Kernels {
  static auto lanes(const void* field, const Descent& d) {
    return lanes_of(*static_cast<const Field*>(field), *d.shell);
  }
  static bool touches(const void* field, Descent& d, std::uint32_t node) {
    return touches_one(lanes(field, d), d, node);
  }
  static std::uint32_t touching(const void* field, Descent& d, IndexRange nodes, std::uint32_t* out) {
    return touching_lanes(lanes(field, d), d, nodes, out);
  }
  static void descend(const void* field, Descent& d) { descend_lanes(lanes(field, d), d); }
  static void test_list(const void* field, Descent& d, const PointList& list) {
    test_list_lanes(lanes(field, d), d, list);
  }
  static void measure_ways(const void* field, const Descent& d, const PointList& list, float jump, float* ways) {
    measure_ways_lanes(lanes(field, d), d, list, jump, ways);
  }
  static void test_parents(const void* field, Descent& d, std::uint32_t from, std::uint32_t to) {
    test_parents_lanes(lanes(field, d), d, from, to);
  }
};

template <class... Fields>
const DescentKernels& kernels_at(std::size_t kind, const std::tuple<Fields...>*) {
  static constexpr DescentKernels kAll[] = {{&Kernels<Fields>::touches, &Kernels<Fields>::touching,
                                             &Kernels<Fields>::descend, &Kernels<Fields>::test_list,
                                             &Kernels<Fields>::measure_ways, &Kernels<Fields>::test_parents}...};
  return kAll[kind];
}
const DescentKernels& descent_kernels_here(std::size_t kind) {
  return kernels_at(kind, static_cast<const KernelFields*>(nullptr));
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(descent_kernels_here);
const DescentKernels& descent_kernels(std::size_t kind) noexcept {
  return HWY_DYNAMIC_DISPATCH(descent_kernels_here)(kind);
}

}  // namespace vps::detail
#endif

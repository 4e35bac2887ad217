// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/queries/descend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/queries/descend.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "runtime/queries/point_tests-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// The spheres of a batch, in the field.
struct Spheres {
  Points centre;
  F radius;
  F reach;  // radius + contact distance
};
// Largest distance of a hit in these spheres off the field.
template <class Lanes>
HWY_INLINE F distance_of(const Lanes& field, const Descent& d, const Points& codes, F radius) {
  const F distance = set(d.contact_distance);
  if (d.moving == nullptr) return distance;
  const F growth = hn::MulAdd(set(d.moving->turn), radius, growth_of(field, d, codes));
  return hn::Min(distance, hn::Add(growth, set(d.moving->near)));
}
template <class Lanes>
HWY_INLINE Spheres spheres_of(const Lanes& field, const Descent& d, const Batch& batch) {
  const Points codes = load_centres(*d.shell, batch);
  const F radius = hn::MulAdd(load_radii(*d.shell, batch), set(d.radius_scale), set(d.slack));
  return {field.place(d.points, codes), radius, hn::Add(radius, distance_of(field, d, codes, radius))};
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
HWY_INLINE M touching(const Batch& batch, F reach, F bound) {
  return hn::And(valid_lanes(batch), hn::Ge(hn::Add(bound, reach), hn::Zero(f32)));
}

template <class Lanes>
bool touches_one(const Lanes& field, Descent& d, std::uint32_t node) {
  const Batch batch{node, 1, 0};
  const Spheres spheres = spheres_of(field, d, batch);
  const F at_centre = field.bound(spheres.centre, spheres.reach);
  const bool touch = !hn::AllFalse(f32, touching(batch, spheres.reach, at_centre));
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
  F radius, bound;
  M touch;
  if (const CodeBound* const region = region_of(field, d); region != nullptr) {
    const Points codes = load_centres(*d.shell, batch);
    radius = hn::MulAdd(load_radii(*d.shell, batch), set(d.radius_scale), set(d.rounding));
    bound = height_of(*region, codes);
    touch = touching(batch, hn::Add(radius, distance_of(field, d, codes, radius)), bound);
  } else {
    const Spheres spheres = spheres_of(field, d, batch);
    radius = spheres.radius;
    bound = bound_at(field, d, spheres);
    touch = touching(batch, spheres.reach, bound);
  }
  const M apart = hn::AndNot(touch, valid_lanes(batch));
  // Upper bounds of V below the spheres, unless they touch: docs/internals/bounds.md.
  const F below = hn::Add(bound, radius);
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
      if (d.region != nullptr) {
        const F ceiling = height_of(*d.region, listed_codes(list, i));
        way = hn::Max(way, hn::Neg(hn::Add(ceiling, set(d.contact_distance))));
      }
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

// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/queries/descend.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/queries/descend.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

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
  const float* const* const rows = d.shell->sphere;
  const std::size_t length = d.shell->nodes;
  const Points stored = {load_floats<Lanes::kPaired>(rows[0], length, batch),
                         load_floats<Lanes::kPaired>(rows[1], length, batch),
                         load_floats<Lanes::kPaired>(rows[2], length, batch)};
  const F radius = hn::MulAdd(load_floats<Lanes::kPaired>(rows[3], length, batch), set(d.radius_scale), set(d.slack));
  F distance = set(d.contact_distance);
  if (d.moving != nullptr) {
    const F way = hn::MulAdd(set(d.moving->turn), radius, way_of(d.moving->node_ways, stored));
    distance = hn::Min(distance, hn::Add(way, set(d.moving->near)));
  }
  return {field.place(d.nodes, stored), radius, hn::Add(radius, distance)};
}

// Which spheres may touch, from the field's bound at their centres.
template <class Lanes>
HWY_INLINE M touching(const Batch& batch, const Spheres& spheres, F bound) {
  return hn::And(valid_lanes<Lanes::kPaired>(batch), hn::Ge(hn::Add(bound, spheres.reach), hn::Zero(f32)));
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
  const Batch batch{{node, 1, 0}, {}};
  const Spheres spheres = spheres_of(field, d, batch);
  const F at_centre = field.bound(spheres.centre, spheres.reach);
  const bool touch = !hn::AllFalse(f32, touching<Lanes>(batch, spheres, at_centre));
  const float bound = hn::GetLane(hn::Add(at_centre, spheres.radius));
  if (!touch && bound > d.rejected) d.rejected = bound;
  if (touch && d.bounds != nullptr) d.bounds[0] = bound;
  ++d.nodes_tested;
  return touch;
}

// Points with the codes of their positions, and where they lie in the field.
struct PlacedPoints {
  Points codes, at;
};

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

// Returns the children of a queue's nodes in chunks.
template <bool kPaired>
class Chunks {
 public:
  Chunks(const Descent& d, std::uint32_t head) : d_(d), head_(head) {}

  // Gets the next chunk of a node with a number below `last`, if the queue up to `tail` has one.
  HWY_INLINE bool next(std::uint32_t tail, std::uint32_t last, ChunkRange& range) {
    if (left_ == 0) {
      if (head_ >= tail || head_ >= d_.stop || d_.queue[head_] >= last) return false;
      parent_ = d_.queue[head_++];
      first_ = d_.shell->children[2 * parent_];
      left_ = d_.shell->children[2 * parent_ + 1];
    }
    constexpr auto kMost = static_cast<std::uint32_t>(hn::MaxLanes(Chunk<kPaired>()));
    range = {first_, left_ < kMost ? left_ : kMost, parent_};
    first_ += range.count;
    left_ -= range.count;
    return true;
  }
  [[nodiscard]] std::uint32_t head() const { return head_; }

 private:
  const Descent& d_;
  std::uint32_t head_;
  std::uint32_t first_ = 0, left_ = 0, parent_ = 0;
};

template <class Lanes>
void descend_lanes(const Lanes& field, Descent& d) {
  const Words u32;
  const std::uint32_t leaves = d.shell->level_offsets[d.shell->levels - 1];
  const std::uint32_t last_inner = leaves < d.last_node ? leaves : d.last_node;
  F rejected = set(d.rejected);
  F deepest = set(d.deepest);
  const F limit = set(-d.contact_distance);
  constexpr bool kTwo = in_halves<Lanes::kPaired>;
  Chunks<Lanes::kPaired> chunks(d, d.begin);
  std::uint32_t tail = d.end;
  const auto next = [&](std::uint32_t last, Batch& batch) {
    batch.high = {};  // it may hold nodes, and their numbers are not valid for points
    if (!chunks.next(tail, last, batch.low)) return false;
    if constexpr (kTwo) (void)chunks.next(tail, last, batch.high);
    return true;
  };
  const auto take_spheres = [&](const Batch& batch, const Spheres& spheres, F bound) {
    const M touch = touching<Lanes>(batch, spheres, bound);
    const M apart = hn::AndNot(touch, valid_lanes<Lanes::kPaired>(batch));
    // Upper bounds of V below the spheres, unless they touch: docs/bounds.md.
    const F below = hn::Add(bound, spheres.radius);
    rejected = hn::IfThenElse(apart, hn::Max(rejected, below), rejected);
    if (d.bounds != nullptr) store_packed(f32, below, touch, d.bounds + tail);
    tail += store_packed(u32, numbers_of<Lanes::kPaired>(batch), hn::RebindMask(u32, touch), d.queue + tail);
    d.nodes_tested += batch.low.count + batch.high.count;
  };
  const auto take_points = [&](const Batch& batch, const PlacedPoints& p, F v, M sampled) {
    const M valid = valid_lanes<Lanes::kPaired>(batch);
    F least = limit;
    if (d.moving != nullptr) {
      least = hn::Max(limit, hn::Neg(hn::Add(way_of(d.moving->point_ways, p.codes), set(d.moving->near))));
    }
    const M hit = find_hits(field, p.at, sampled, valid, least, v);
    deepest = hn::IfThenElse(valid, hn::Max(deepest, v), deepest);
    d.points_tested += batch.low.count + batch.high.count;
    if (hn::AllFalse(f32, hit)) return;
    auto parents = hn::Set(u32, batch.low.parent);
    if constexpr (kTwo) {
      parents = hn::IfThenElse(hn::FirstN(u32, kHalf), parents, hn::Set(u32, batch.high.parent));
    }
    add_hits(p.codes, numbers_of<Lanes::kPaired>(batch), parents, v, hit, d);
  };

  // Look-ups in an octree wait for memory at each node. Two vectors at a time wait together.
  Batch batch;
  Batch other;
  while (next(last_inner, batch)) {
    const Spheres spheres = spheres_of(field, d, batch);
    if constexpr (Lanes::kPaired) {
      if (next(last_inner, other)) {
        const Spheres others = spheres_of(field, d, other);
        typename Lanes::Looked at_first;
        typename Lanes::Looked at_other;
        field.look_up(spheres.centre, others.centre, at_first, at_other);
        take_spheres(batch, spheres, field.bound_of(spheres.centre, spheres.reach, at_first));
        take_spheres(other, others, field.bound_of(others.centre, others.reach, at_other));
        continue;
      }
    }
    take_spheres(batch, spheres, field.bound(spheres.centre, spheres.reach));
  }
  // After the inner nodes the queue has only leaves.
  const auto points_of = [&](const Batch& of) -> PlacedPoints {
    const Points codes = load_points<Lanes::kPaired>(*d.shell, of);
    return {codes, field.place(d.points, codes)};
  };
  while (next(d.last_node, batch)) {
    const PlacedPoints points = points_of(batch);
    if constexpr (Lanes::kPaired) {
      if (next(d.last_node, other)) {
        const PlacedPoints others = points_of(other);
        typename Lanes::Looked at_first;
        typename Lanes::Looked at_other;
        field.look_up(points.at, others.at, at_first, at_other);
        take_points(batch, points, field.value_of(points.at, at_first), at_first.sampled);
        take_points(other, others, field.value_of(others.at, at_other), at_other.sampled);
        continue;
      }
    }
    M sampled;
    const F v = value_at(field, points.at, batch, valid_lanes<Lanes::kPaired>(batch), sampled);
    take_points(batch, points, v, sampled);
  }
  d.begin = chunks.head();
  d.end = tail;
  d.rejected = hn::GetLane(hn::MaxOfLanes(f32, rejected));
  d.deepest = hn::GetLane(hn::MaxOfLanes(f32, deepest));
}

template <class Lanes>
void test_list_lanes(const Lanes& field, Descent& d, const PointList& list) {
  const Words u32;
  const F limit = set(-d.contact_distance);
  F deepest = set(d.deepest);
  for (std::uint32_t i = 0; i < list.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    const Points codes = {hn::LoadU(f32, list.codes[0] + i), hn::LoadU(f32, list.codes[1] + i),
                          hn::LoadU(f32, list.codes[2] + i)};
    const M valid = hn::FirstN(f32, list.count - i);
    const Points p = field.place(d.points, codes);
    M sampled;
    F v = value_at(field, p, Batch(), valid, sampled);
    const M hit = find_hits(field, p, sampled, valid, limit, v);
    deepest = hn::IfThenElse(valid, hn::Max(deepest, v), deepest);
    add_hits(codes, hn::LoadU(u32, list.points + i), hn::LoadU(u32, list.leaves + i), v, hit, d);
  }
  d.points_tested += list.count;
  d.deepest = hn::GetLane(hn::MaxOfLanes(f32, deepest));
}

template <class Lanes>
void test_parents_lanes(const Lanes& field, Descent& d, std::uint32_t from, std::uint32_t to) {
  const Words u32;
  // One point at a time for fields that need the point's number.
  const std::size_t most = std::is_same_v<Lanes, PlainLanes> ? 1 : hn::Lanes(f32);
  const F limit = set(-d.contact_distance);
  F deepest = set(d.deepest);
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
    const M valid = hn::FirstN(f32, count);
    const Batch batch{{points[0], count, 0}, {}};
    const Points p = field.place(d.points, stored);
    M sampled;
    F v = value_at(field, p, batch, valid, sampled);
    const M hit = find_hits(field, p, sampled, valid, limit, v);
    deepest = hn::IfThenElse(valid, hn::Max(deepest, v), deepest);
    add_hits(stored, hn::Load(u32, points), hn::LoadU(u32, d.queue + from), v, hit, d);
    from += count;
  }
  d.deepest = hn::GetLane(hn::MaxOfLanes(f32, deepest));
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
  static void descend(const void* field, Descent& d) { descend_lanes(lanes(field, d), d); }
  static void test_list(const void* field, Descent& d, const PointList& list) {
    test_list_lanes(lanes(field, d), d, list);
  }
  static void test_parents(const void* field, Descent& d, std::uint32_t from, std::uint32_t to) {
    test_parents_lanes(lanes(field, d), d, from, to);
  }
};

template <class... Fields>
const DescentKernels& kernels_at(std::size_t kind, const std::tuple<Fields...>*) {
  static constexpr DescentKernels kAll[] = {{&Kernels<Fields>::touches, &Kernels<Fields>::descend,
                                             &Kernels<Fields>::test_list, &Kernels<Fields>::test_parents}...};
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

// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/queries/find_deepest.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/queries/find_deepest.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "runtime/fields/sampled_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

constexpr auto kMost = static_cast<std::uint32_t>(hn::MaxLanes(Floats()));

// Upper bounds of the true V by the planes. They hold where they are below `least`: there points are outside.
template <class Lanes>
HWY_INLINE F ceiling_at(const Lanes& field, const Points& p, float& least) {
  if constexpr (Lanes::kHasFarGrid) {
    if (field.map.planes != nullptr) {
      least = -field.map.error;
      return field.ceiling(p).v;
    }
  }
  least = std::numeric_limits<float>::lowest();
  return hn::Zero(f32);
}

template <class Lanes>
HWY_INLINE void test_points(const Lanes& field, std::uint32_t first, std::uint32_t count, DeepestSearch& s) {
  s.points_tested += count;
  for (const std::uint32_t last = first + count; first < last; first += kMost) {
    const Batch batch{first, last - first < kMost ? last - first : kMost, 0};
    const M listed = hn::FirstN(f32, batch.count);
    const Points p = field.place(s.points, load_points(*s.shell, batch));
    // The planes tell which points are nearer than all before.
    float least = 0;
    const F ceiling = ceiling_at(field, p, least);
    const float passed = s.best < s.deepest ? s.best : s.deepest;
    const M below = hn::And(hn::Lt(ceiling, set(least)), hn::Le(ceiling, set(passed)));
    const M valid = hn::AndNot(below, listed);
    if (hn::AllFalse(f32, valid)) continue;
    const Penetrations found = field.penetrations(p, batch, valid);
    const F highest = hn::IfThenElse(valid, found.highest, set(s.best));
    s.best = hn::GetLane(hn::MaxOfLanes(f32, hn::Max(highest, set(s.best))));
    const M deeper = hn::And(valid, hn::Gt(found.value, set(s.deepest)));
    if (hn::AllFalse(f32, deeper)) continue;
    const F largest = hn::MaxOfLanes(f32, hn::IfThenElse(deeper, found.value, set(s.deepest)));
    s.deepest = hn::GetLane(largest);
    s.point = first + static_cast<std::uint32_t>(hn::FindFirstTrue(f32, hn::And(deeper, hn::Eq(found.value, largest))));
  }
}

// Bounds above this one are searched. Inside and beyond the band a bound is voxels above the V below it, so only V
// ends the search. Outside the search would then visit most points of a far body.
inline float threshold(const DeepestSearch& s) {
  return (s.best >= 0 && s.deepest < s.best ? s.deepest : s.best) - s.margin;
}

// Pushes the nodes whose spheres may hold a deeper point on the stack, which ends at `top`. @return its new end
template <class Lanes>
HWY_INLINE std::uint32_t push(const Lanes& field, const Batch& batch, std::uint32_t top, DeepestSearch& s) {
  const Words u32;
  const F radius = hn::MulAdd(load_radii(*s.shell, batch), set(s.radius_scale), set(s.slack));
  const M valid = hn::FirstN(f32, batch.count);
  const Points p = field.place(s.points, load_centres(*s.shell, batch));
  float least = 0;
  F highest = ceiling_at(field, p, least);
  const M unknown = hn::And(valid, hn::Ge(highest, set(least)));
  if (!hn::AllFalse(f32, unknown)) {
    highest = hn::IfThenElse(unknown, field.penetrations(p, batch, unknown).highest, highest);
  }
  const F bound = hn::Add(highest, radius);
  const M open = hn::And(valid, hn::Gt(bound, set(threshold(s))));
  const F rejected = set(s.rejected);
  const F passed = hn::IfThenElse(hn::AndNot(open, valid), hn::Max(bound, rejected), rejected);
  s.rejected = hn::GetLane(hn::MaxOfLanes(f32, passed));
  s.nodes_tested += batch.count;
  store_packed(u32, numbers_of(batch), hn::RebindMask(u32, open), s.stack + top);
  return top + store_packed(f32, bound, open, s.bounds + top);
}

// Sorts the stack's entries [first, last) so that the largest bound is last.
inline void sort_rising(std::uint32_t first, std::uint32_t last, DeepestSearch& s) {
  for (std::uint32_t i = first + 1; i < last; ++i) {
    const float bound = s.bounds[i];
    const std::uint32_t node = s.stack[i];
    std::uint32_t at = i;
    for (; at > first && s.bounds[at - 1] > bound; --at) {
      s.bounds[at] = s.bounds[at - 1];
      s.stack[at] = s.stack[at - 1];
    }
    s.bounds[at] = bound;
    s.stack[at] = node;
  }
}

template <class Lanes>
void find_deepest_lanes(const Lanes& field, DeepestSearch& s) {
  s.deepest = s.best = s.floor;
  s.rejected = std::numeric_limits<float>::lowest();
  test_points(field, s.point, 1, s);
  const std::uint32_t leaves = s.shell->level_offsets[s.shell->levels - 1];
  std::uint32_t top = push(field, Batch{0, 1, 0}, 0, s);
  while (top > 0) {
    --top;
    if (!(s.bounds[top] > threshold(s))) {
      s.rejected = s.bounds[top] > s.rejected ? s.bounds[top] : s.rejected;
      continue;
    }
    const std::uint32_t node = s.stack[top];
    const auto [first, last] = children_of(*s.shell, node);
    if (node >= leaves) {
      test_points(field, first, last - first, s);
      continue;
    }
    std::uint32_t end = top;
    for (std::uint32_t child = first; child < last; child += kMost) {
      end = push(field, Batch{child, last - child < kMost ? last - child : kMost, node}, end, s);
    }
    sort_rising(top, end, s);
    top = end;
  }
}

// The search with a type-erased field.
template <class Field>
void search_field(const void* field, DeepestSearch& s) {
  find_deepest_lanes(lanes_of(*static_cast<const Field*>(field), *s.shell), s);
}

template <class... Fields>
DeepestKernel kernel_at(std::size_t kind, const std::tuple<Fields...>*) {
  static constexpr DeepestKernel kAll[] = {&search_field<Fields>...};
  return kAll[kind];
}
DeepestKernel deepest_kernel_here(std::size_t kind) {
  return kernel_at(kind, static_cast<const KernelFields*>(nullptr));
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(deepest_kernel_here);
DeepestKernel deepest_kernel(std::size_t kind) noexcept {
  return HWY_DYNAMIC_DISPATCH(deepest_kernel_here)(kind);
}

}  // namespace vps::detail
#endif

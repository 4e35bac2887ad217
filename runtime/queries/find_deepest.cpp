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

template <class Lanes>
HWY_INLINE void test_points(const Lanes& field, std::uint32_t first, std::uint32_t count, DeepestSearch& s) {
  s.points_tested += count;
  for (const std::uint32_t last = first + count; first < last; first += kMost) {
    const Batch batch{{first, last - first < kMost ? last - first : kMost, 0}, {}};
    const M valid = hn::FirstN(f32, batch.low.count);
    const Penetrations found =
        field.penetrations(field.place(s.points, load_points<false>(*s.shell, batch)), batch, valid);
    const F highest = hn::IfThenElse(valid, found.highest, set(s.best));
    s.best = hn::GetLane(hn::MaxOfLanes(f32, hn::Max(highest, set(s.best))));
    const M deeper = hn::And(valid, hn::Gt(found.value, set(s.deepest)));
    if (hn::AllFalse(f32, deeper)) continue;
    const F largest = hn::MaxOfLanes(f32, hn::IfThenElse(deeper, found.value, set(s.deepest)));
    s.deepest = hn::GetLane(largest);
    s.point = first + static_cast<std::uint32_t>(hn::FindFirstTrue(f32, hn::And(deeper, hn::Eq(found.value, largest))));
  }
}

// Pushes the nodes whose spheres may hold a deeper point on the stack, which ends at `top`. @return its new end
template <class Lanes>
HWY_INLINE std::uint32_t push(const Lanes& field, const Batch& batch, std::uint32_t top, DeepestSearch& s) {
  const Words u32;
  const float* const* const rows = s.shell->sphere;
  const std::size_t length = s.shell->nodes;
  const Points centre = {load_floats<false>(rows[0], length, batch), load_floats<false>(rows[1], length, batch),
                         load_floats<false>(rows[2], length, batch)};
  const F radius = hn::MulAdd(load_floats<false>(rows[3], length, batch), set(s.radius_scale), set(s.slack));
  const M valid = hn::FirstN(f32, batch.low.count);
  const F bound = hn::Add(field.penetrations(field.place(s.nodes, centre), batch, valid).highest, radius);
  const M open = hn::And(valid, hn::Gt(bound, set(s.best - s.margin)));
  const F rejected = set(s.rejected);
  const F passed = hn::IfThenElse(hn::AndNot(open, valid), hn::Max(bound, rejected), rejected);
  s.rejected = hn::GetLane(hn::MaxOfLanes(f32, passed));
  s.nodes_tested += batch.low.count;
  store_packed(u32, numbers_of<false>(batch), hn::RebindMask(u32, open), s.stack + top);
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
  s.deepest = s.best = s.rejected = std::numeric_limits<float>::lowest();
  test_points(field, s.point, 1, s);
  const std::uint32_t leaves = s.shell->level_offsets[s.shell->levels - 1];
  std::uint32_t top = push(field, Batch{{0, 1, 0}, {}}, 0, s);
  while (top > 0) {
    --top;
    if (!(s.bounds[top] > s.best - s.margin)) {
      s.rejected = s.bounds[top] > s.rejected ? s.bounds[top] : s.rejected;
      continue;
    }
    const std::uint32_t node = s.stack[top];
    const std::uint32_t first = s.shell->children[2 * node];
    const std::uint32_t last = first + s.shell->children[2 * node + 1];
    if (node >= leaves) {
      test_points(field, first, last - first, s);
      continue;
    }
    std::uint32_t end = top;
    for (std::uint32_t child = first; child < last; child += kMost) {
      end = push(field, Batch{{child, last - child < kMost ? last - child : kMost, node}, {}}, end, s);
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

// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time. Loops are plain and without early exits, so that
// compilers vectorize them: this runs at every open.
#include "formats/check_octree.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "formats/check_octree.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <algorithm>

#include "formats/vps_format.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// What entries of the octree may refer to. As signed numbers nodes lie below kFarInside and kFarOutside, which are -2
// and -1, and bricks from 0 on. Truth values are numbers, because then compilers vectorize the loops.
struct EntryLimits {
  std::int32_t end_node;  // signed entry of the node after the last
  std::int32_t slices;

  EntryLimits(std::uint64_t nodes, std::uint64_t stored_slices) noexcept
      : end_node(signed_node(nodes)),
        slices(static_cast<std::int32_t>(std::min<std::uint64_t>(stored_slices, INT32_MAX))) {}
  static std::int32_t signed_node(std::uint64_t node) noexcept {
    return static_cast<std::int32_t>(octree::node_entry(static_cast<std::uint32_t>(node)));
  }
  // @param least_node  signed
  [[nodiscard]] std::int32_t is_bad(std::uint32_t entry, std::int32_t least_node) const noexcept {
    const auto e = static_cast<std::int32_t>(entry);
    const std::int32_t bad_node = (e < least_node) | ((e >= end_node) & (e < static_cast<std::int32_t>(kFarInside)));
    const std::int32_t last =
        static_cast<std::int32_t>(octree::slice_of(entry)) + kFieldEdge - (e >> kLeftOutShift & 3);
    return bad_node | ((e >= 0) & ((last > slices) | ((e >> kAxisShift & 3) == 3)));
  }
};

bool octree_is_good_here(std::span<const std::uint32_t> roots, std::span<const std::uint32_t> nodes,
                         std::uint64_t slices, std::uint64_t planes) {
  const std::uint64_t count = nodes.size() / 8;
  if (count > kMostNodes) return false;
  const EntryLimits limits(count, slices);
  const auto most_planes = static_cast<std::int32_t>(std::min<std::uint64_t>(planes, INT32_MAX));
  const std::int32_t checks_planes = planes != 0;
  std::int32_t bad = 0;
  for (const std::uint32_t root : roots) {
    const auto e = static_cast<std::int32_t>(root);
    const std::int32_t is_negative = e < 0;
    bad |= is_negative & limits.is_bad(root, EntryLimits::signed_node(0));
    // With planes a block without samples has one.
    const std::int32_t is_far = is_negative & (e >= static_cast<std::int32_t>(kFarInside));
    const std::int32_t has_octants = (root & (kNodeFlag | kOctantsFlag)) != 0;
    bad |=
        checks_planes & (is_far | (has_octants & (static_cast<std::int32_t>(octree::planes_of(root)) >= most_planes)));
  }
  std::int32_t bad_octant[8] = {};
  for (std::uint64_t n = 0; n < count; ++n) {
    const std::int32_t next = EntryLimits::signed_node(n + 1);
    for (std::uint64_t i = 0; i < 8; ++i) bad_octant[i] |= limits.is_bad(nodes[8 * n + i], next);
  }
  for (const std::int32_t octant : bad_octant) bad |= octant;
  return bad == 0;
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(octree_is_good_here);
bool octree_is_good(std::span<const std::uint32_t> roots, std::span<const std::uint32_t> nodes, std::uint64_t slices,
                    std::uint64_t planes) noexcept {
  return HWY_DYNAMIC_DISPATCH(octree_is_good_here)(roots, nodes, slices, planes);
}

}  // namespace vps::detail
#endif

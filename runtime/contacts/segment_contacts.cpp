// SPDX-License-Identifier: Zlib
// Matches the contacts of each segment with those of the step before. Paper: Sec. 2.4.
#include "runtime/contacts/segment_contacts.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/fields/penetration.h"

namespace vps::detail {
namespace {

using Kept = std::array<const ManifoldContact*, kContactsPerSegment>;

// The place that a new deepest point takes.
const ManifoldContact*& place_for(const ManifoldContact& fresh, float beside, Kept& kept) {
  const auto worth = [&](const ManifoldContact* one) {
    if (one == nullptr) return -std::numeric_limits<float>::max();
    const bool is_beside = length(one->position - fresh.position) < beside;
    return is_beside ? -std::numeric_limits<float>::infinity() : one->penetration;
  };
  return *std::min_element(kept.begin(), kept.end(),
                           [&](const ManifoldContact* a, const ManifoldContact* b) { return worth(a) < worth(b); });
}

}  // namespace

void SegmentMemory::belong_to(const PointshellView& of_shell, std::uint32_t of_level) {
  const void* const now = of_level > 0 ? of_shell.position[0] : nullptr;
  if (shell == now && shell_points == of_shell.points && level == of_level) return;
  points.clear();
  shell = now;
  shell_points = of_shell.points;
  level = of_level;
}

std::span<const SegmentPoint> keep_segments(std::span<const ManifoldContact> contacts, float beside, float alike,
                                            SegmentMemory& memory) {
  memory.last.swap(memory.points);
  memory.points.clear();
  auto old = memory.last.begin();
  while (!contacts.empty()) {
    const std::uint32_t node = contacts.front().node;
    Kept kept{};
    const ManifoldContact* fresh = nullptr;
    while (old != memory.last.end() && old->node < node) ++old;
    const auto end = std::find_if(old, memory.last.end(), [=](const SegmentPoint& o) { return o.node != node; });
    for (; !contacts.empty() && contacts.front().node == node; contacts = contacts.subspan(1)) {
      const ManifoldContact& contact = contacts.front();
      const auto same = std::find_if(old, end, [&](const SegmentPoint& o) { return o.feature == contact.feature; });
      (same == end ? fresh : kept[static_cast<std::size_t>(same->place)]) = &contact;
    }
    if (fresh != nullptr) {
      const ManifoldContact*& place = place_for(*fresh, beside, kept);
      if (place == nullptr || fresh->penetration > place->penetration + alike) place = fresh;
    }
    for (int i = 0; i < kContactsPerSegment; ++i) {
      const ManifoldContact* const contact = kept[static_cast<std::size_t>(i)];
      if (contact != nullptr) memory.points.push_back({node, contact->point, contact->feature, i, contact});
    }
    old = end;
  }
  return memory.points;
}

}  // namespace vps::detail

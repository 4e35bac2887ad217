// SPDX-License-Identifier: Zlib
// Segmented traverse, Sec. 2.4 of the paper: the clusters of the segmentation level are found once, and Algorithm 1
// then keeps the deepest point of each.
#include <algorithm>
#include <utility>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

// Takes hits [first, last) of the descent as those of a segment that has no contact yet.
void take_segment(TraverseQuery& query, std::uint32_t node, std::uint32_t first, std::uint32_t last) noexcept {
  Contact deepest;
  deepest.penetration = kNothingTested;
  query.segment = &deepest;
  take_hits(query, HitsAre::points, first, last);
  query.segment = nullptr;
  if (!(deepest.penetration > kNothingTested)) return;
  deepest.node = node;
  Contact* const begin = query.out.data();
  Contact* const end = begin + std::min<std::size_t>(query.result.contacts, query.out.size());
  write_contact(query, deepest);
  if (end == begin + query.out.size()) return;
  // An earlier search may have answered segments behind it.
  Contact* at = end;
  while (at != begin && (at - 1)->node > node) --at;
  if (at != end) std::rotate(at, end, end + 1);
}

// Finds the segments that points belong to: most of them are in that of the point before.
class SegmentOfPoint {
 public:
  SegmentOfPoint(const PointshellView& shell, std::span<const std::uint32_t> segments) noexcept
      : shell_(shell), segments_(segments) {
    go_to(0);
  }
  // @return the segment's place in the list; its end for points in none of them, which a forged asset may have
  std::size_t find(std::uint32_t point) noexcept {
    if (is_in(point)) return at_;
    if (at_ < segments_.size()) go_to(at_ + 1);
    if (is_in(point)) return at_;
    const auto is_before = [&](std::uint32_t node) { return points_below(shell_, node).end <= point; };
    const auto found = std::partition_point(segments_.begin(), segments_.end(), is_before);
    go_to(static_cast<std::size_t>(found - segments_.begin()));
    return is_in(point) ? at_ : segments_.size();
  }

 private:
  void go_to(std::size_t at) noexcept {
    at_ = at;
    range_ = at < segments_.size() ? points_below(shell_, segments_[at]) : IndexRange();
  }
  [[nodiscard]] bool is_in(std::uint32_t point) const noexcept { return point >= range_.begin && point < range_.end; }

  const PointshellView& shell_;
  const std::span<const std::uint32_t> segments_;
  std::size_t at_ = 0;
  IndexRange range_{};
};

// Takes the hits of all segments, in tree order.
void take_in_order(TraverseQuery& query, std::span<const std::uint32_t> segments) noexcept {
  const Descent& d = query.descent;
  SegmentOfPoint of_point(query.shell, segments);
  for (std::uint32_t hit = 0; hit < d.hit_count;) {
    const std::uint32_t begin = hit++;
    const std::size_t segment = of_point.find(d.hits[begin]);
    if (segment == segments.size()) continue;
    while (hit < d.hit_count && of_point.find(d.hits[hit]) == segment) ++hit;
    take_segment(query, segments[segment], begin, hit);
  }
}

// The same of hits in any order, without force and torque: those of flat nodes come level by level.
void take_deepest(TraverseQuery& query, std::span<const std::uint32_t> segments) noexcept {
  constexpr std::uint32_t kNone = UINT32_MAX;
  const Descent& d = query.descent;
  std::uint32_t* const deepest = d.queue + d.end;  // the queue has room for all nodes twice
  std::fill_n(deepest, segments.size(), kNone);
  SegmentOfPoint of_point(query.shell, segments);
  for (std::uint32_t hit = 0; hit < d.hit_count; ++hit) {
    const std::size_t segment = of_point.find(d.hits[hit]);
    if (segment == segments.size()) continue;
    std::uint32_t& most = deepest[segment];
    if (most == kNone || d.penetrations[hit] > d.penetrations[most]) most = hit;
  }
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (deepest[i] != kNone) take_segment(query, segments[i], deepest[i], deepest[i] + 1);
  }
}

// All segments, entries [first, last) of the queue, go down together.
void seek_together(TraverseQuery& query, std::uint32_t first, std::uint32_t last) noexcept {
  Descent& d = query.descent;
  d.begin = first;
  d.end = last;
  d.last_node = query.shell.nodes;
  d.flat_count = 0;
  query.field.descend(d);
  ask_flat_nodes(query, d.flat_count);
  const std::span<const std::uint32_t> segments(d.queue + first, last - first);
  if (d.flats == nullptr) {
    take_in_order(query, segments);
  } else {
    take_deepest(query, segments);
  }
  d.hit_count = 0;
}

// Moves those of the segments, entries [first, last) of the queue, to the front that have no contact.
// @return where they end
std::uint32_t leave_answered(TraverseQuery& query, std::uint32_t first, std::uint32_t last) noexcept {
  std::uint32_t* const queue = query.descent.queue;
  const Contact* at = query.out.data();
  const Contact* const end = at + std::min<std::size_t>(query.result.contacts, query.out.size());
  const auto is_answered = [&](std::uint32_t node) {
    while (at != end && at->node < node) ++at;
    return at != end && at->node == node;
  };
  return static_cast<std::uint32_t>(std::remove_if(queue + first, queue + last, is_answered) - queue);
}

// Without a budget. Points ahead are sought near the field first: none that is farther is deeper.
void traverse_together(TraverseQuery& query, std::uint32_t first, std::uint32_t last) noexcept {
  constexpr float kNearest = 4;  // covering radii; a body that rolls moves three in a step
  Descent& d = query.descent;
  if (d.moving != nullptr && !query.has_facets && d.flats == nullptr) {
    const float farthest = d.contact_distance;
    const float way = farthest - d.moving->near;
    float ahead = kNearest * query.shell.covering_radius / d.unit;
    for (; ahead > 0 && 2 * ahead < way && first < last; ahead *= 2) {
      const float rejected = d.rejected;
      d.contact_distance = d.moving->near + ahead;
      seek_together(query, first, last);
      const std::uint32_t left = leave_answered(query, first, last);
      // The next search has bounds of its own for the segments that are left.
      if (left == last) d.rejected = rejected;
      last = left;
    }
    d.contact_distance = farthest;
  }
  seek_together(query, first, last);
  sharpen_distance(query, 0, d.begin);
}

// Traverses one segment: entry `segment` of the queue. The segment's own queue begins at entry `room`.
void traverse_segment(TraverseQuery& query, std::uint32_t segment, std::uint32_t room) noexcept {
  Descent& d = query.descent;
  const std::uint32_t node = d.queue[segment];
  Contact deepest;
  deepest.penetration = kNothingTested;
  query.segment = &deepest;
  d.bounds[room] = d.bounds[segment];
  query.result.complete = descend_in_blocks(query, node, room, query.shell.nodes);
  take_hits(query, HitsAre::points);
  const std::uint32_t expanded = d.begin;
  represent(query, d.begin, d.end);
  if (deepest.penetration > kNothingTested) {
    deepest.node = node;
    write_contact(query, deepest);
  } else {
    sharpen_distance(query, room, expanded);
  }
  query.segment = nullptr;
}

}  // namespace

void traverse_segments(TraverseQuery& query) noexcept {
  const PointshellView& shell = query.shell;
  Descent& d = query.descent;
  const std::uint32_t level = query.options.segment_level < shell.levels ? query.options.segment_level : shell.levels;
  if (!query.field.touches(d, 0)) return;
  std::uint32_t* const flats = std::exchange(d.flats, nullptr);  // above the segments no node is set aside
  query.result.complete = descend_in_blocks(query, 0, 0, shell.level_offsets[level - 1]);
  d.flats = flats;
  const std::uint32_t first = d.begin;
  const std::uint32_t last = d.end;
  if (!query.budget.limited()) return traverse_together(query, first, last);
  std::uint32_t segment = first;
  for (; segment < last && query.result.complete; ++segment) {
    query.waiting = last - segment - 1;
    traverse_segment(query, segment, last);
  }
  query.waiting = 0;
  // The segments that the budget did not reach.
  represent(query, segment, last);
  sharpen_distance(query, 0, first);
}

}  // namespace vps::detail

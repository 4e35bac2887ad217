// SPDX-License-Identifier: Zlib
// Segmented traverse, Sec. 2.4 of the paper: the clusters of the segmentation level are found once, and Algorithm 1
// then keeps the deepest point of each.
#include <algorithm>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

// Takes hits [first, last) of the descent as those of one segment.
void take_segment(TraverseQuery& query, std::uint32_t node, std::uint32_t first, std::uint32_t last) noexcept {
  Contact deepest;
  deepest.penetration = kNothingTested;
  query.segment = &deepest;
  take_hits(query, HitsAre::points, first, last);
  query.segment = nullptr;
  if (!(deepest.penetration > kNothingTested)) return;
  deepest.node = node;
  write_contact(query, deepest);
}

// Without a budget all segments, entries [first, last) of the queue, go down together.
void traverse_together(TraverseQuery& query, std::uint32_t first, std::uint32_t last) noexcept {
  Descent& d = query.descent;
  d.last_node = query.shell.nodes;
  query.field.descend(d);
  std::uint32_t hit = 0;
  for (std::uint32_t segment = first; segment < last; ++segment) {
    const std::uint32_t begin = hit;
    const std::uint32_t end = points_below(query.shell, d.queue[segment]).end;
    hit = static_cast<std::uint32_t>(std::lower_bound(d.hits + hit, d.hits + d.hit_count, end) - d.hits);
    if (hit > begin) take_segment(query, d.queue[segment], begin, hit);
  }
  d.hit_count = 0;
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
  query.result.complete = descend_in_blocks(query, 0, 0, shell.level_offsets[level - 1]);
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

// SPDX-License-Identifier: Zlib
// Algorithm 1 of the paper (Sec. 2.3) from one node, in blocks of work. The budget is checked between blocks.
#include <algorithm>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

// Entry of the queue before which the next block of work ends.
std::uint32_t end_of_block(const TraverseQuery& query) noexcept {
  const PointshellView& shell = query.shell;
  const Descent& d = query.descent;
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  std::uint64_t left = query.budget.left(query.tests(), std::uint64_t{query.waiting} + d.end - d.begin);
  std::uint64_t block = Budget::kBlock;
  std::uint32_t at = d.begin;
  for (; at < d.end; ++at) {
    const std::uint32_t node = d.queue[at];
    const auto [begin, end] = children_of(shell, node);
    const std::uint64_t children = end - begin;
    // At the end, the points that represent the remaining nodes are tested, too.
    const std::uint64_t cost = node < leaves ? 2 * children : children;
    // One node fits into any block, however many children it has.
    if (cost > left || (cost > block && at > d.begin)) break;
    left -= cost;
    block -= std::min(cost, block);
  }
  return at;
}

}  // namespace

bool descend_in_blocks(TraverseQuery& query, std::uint32_t node, std::uint32_t at, std::uint32_t last_node) noexcept {
  Descent& d = query.descent;
  d.queue[at] = node;
  d.begin = at;
  d.end = at + 1;
  d.last_node = last_node;
  if (!query.budget.limited()) {
    query.field.descend(d);
    return true;
  }
  while (d.begin < d.end && d.queue[d.begin] < last_node) {
    d.stop = end_of_block(query);
    if (d.stop == d.begin) return false;
    query.field.descend(d);
    take_hits(query, HitsAre::points);
  }
  return true;
}

}  // namespace vps::detail

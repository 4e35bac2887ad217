// SPDX-License-Identifier: Zlib
// Represents each node by one point: P_1 of Eq. (6). Used for levels of detail, for parts that a budget left out, and
// for the distance of bodies that do not touch.
#include <algorithm>
#include <limits>
#include <numeric>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

// Upper bound of V below a node whose sphere touches. In the field's unit.
float most_below(const TraverseQuery& query, std::uint32_t entry) noexcept {
  const Descent& d = query.descent;
  const FieldFacts& facts = query.facts;
  const float radius = sphere_radius(query.shell, d.queue[entry]) + d.unit * d.slack;
  const float centre = d.unit * d.bounds[entry] - radius;
  const float most = centre < facts.known ? std::min(centre + radius + facts.excess, facts.most) : facts.most;
  return most / d.unit;
}

// Tests the points that represent entries [from, to) of the queue by the far grid.
// @return the node of the nearest hit; the number of nodes without one
std::uint32_t nearest_node(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept {
  Descent& d = query.descent;
  d.hit_count = 0;
  query.field.test_parents(d, from, to);
  const auto nearest = std::max_element(d.penetrations, d.penetrations + d.hit_count) - d.penetrations;
  return d.hit_count > 0 ? d.leaves[nearest] : query.shell.nodes;
}

// For a shell beyond the band: V of the points that represent entries [from, to) of the queue, by the far grid. Then
// of those below the nearest, down to the points of a leaf.
void test_far(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept {
  Descent& d = query.descent;
  const PointshellView& shell = query.shell;
  const float wanted = d.contact_distance;
  d.rejected = std::max(d.rejected, d.deepest);  // a bound
  d.deepest = kNothingTested;
  d.contact_distance = std::numeric_limits<float>::max();  // all are hits
  std::uint32_t node = nearest_node(query, from, to);
  if (!query.budget.limited()) {
    while (node < shell.level_offsets[shell.levels - 1]) {
      const auto [begin, end] = children_of(shell, node);
      const std::uint32_t last = to + (end - begin);
      std::iota(d.queue + to, d.queue + last, begin);
      node = nearest_node(query, to, last);
    }
    d.contact_distance = -d.deepest;
    d.hit_count = 0;
    if (node < shell.nodes) (void)descend_in_blocks(query, node, to, shell.nodes);
  }
  d.hit_count = 0;
  d.contact_distance = wanted;
  d.deepest = query.deepest_far = std::max(query.deepest_far, d.deepest);
}

}  // namespace

void represent(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept {
  Descent& d = query.descent;
  for (std::uint32_t i = from; i < to; ++i) d.rejected = std::max(d.rejected, most_below(query, i));
  while (from < to) {
    const auto count =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(to - from, query.budget.left_in_block(query.tests(), 0)));
    if (count == 0) {
      query.result.complete = false;
      break;
    }
    query.field.test_parents(d, from, from + count);
    take_hits(query, HitsAre::nodes);
    from += count;
  }
}

void sharpen_distance(TraverseQuery& query, std::uint32_t from, std::uint32_t to) noexcept {
  Descent& d = query.descent;
  if (d.deepest >= -d.contact_distance) return;
  constexpr float kRounding = 1 - 1e-4F;
  const bool is_far = d.unit * d.deepest < -kRounding * query.facts.certain;
  if (!is_far) to = query.end_of_inner_nodes(from, to);
  if (query.budget.limited()) {
    to = from +
         static_cast<std::uint32_t>(std::min<std::uint64_t>(to - from, query.budget.left_in_block(query.tests(), 0)));
  }
  if (is_far) {
    test_far(query, from, to);
  } else {
    query.field.test_parents(d, from, to);
  }
  d.hit_count = 0;
}

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
// The list of a ContactCache: points that can be in contact while a pair moves little, as the neighbour lists of Verlet
// 1967. A traverse of these points alone finds what Algorithm 1 (Sec. 2.3) does.
//
// V changes by at most the distance that a point moves. A point with V < -reach at the reference pose cannot be in
// contact before it has moved by reach - contact distance, less the field's error at both places. Each point of the
// list, too, is only tested when it has moved by its own way.
#include <algorithm>

#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/grow.h"

namespace vps::detail {
namespace {

PointList list_of(const ContactCache& cache) noexcept {
  return {{cache.codes[0].data(), cache.codes[1].data(), cache.codes[2].data()},
          cache.points.data(),
          cache.leaves.data(),
          static_cast<std::uint32_t>(cache.points.size() - kLanePadding)};
}

// Most by which V changes beyond the way of a point. In the field's unit.
float jump_of(const TraverseQuery& query) noexcept {
  return 2 * query.facts.error / query.descent.unit;
}

void remember_hits(const TraverseQuery& query, ContactCache& cache) {
  const Descent& d = query.descent;
  cache.flats.assign(d.flats, d.flats + d.flat_count);
  const std::size_t count = d.hit_count;
  cache.points.assign(d.hits, d.hits + count);
  cache.leaves.assign(d.leaves, d.leaves + count);
  cache.points.resize(count + kLanePadding);
  cache.leaves.resize(count + kLanePadding);
  cache.ways.resize(count + kLanePadding);
  for (int axis = 0; axis < 3; ++axis) {
    cache.codes[axis].resize(count + kLanePadding);
    for (std::size_t i = 0; i < count; ++i) cache.codes[axis][i] = query.shell.position[axis][d.hits[i]];
  }
  query.field.measure_ways(d, list_of(cache), jump_of(query), cache.ways.data());
}

// @param spent  largest motion of a point since the list was made. [m]
void test_remembered(const ContactCache& cache, double spent, TraverseQuery& query) noexcept {
  Descent& d = query.descent;
  const double farther = std::max(0.0, query.reach - cache.touching);
  const auto moved = static_cast<float>((spent + farther) / d.unit);
  PointList list = list_of(cache);
  list.ways = cache.ways.data();
  list.moved = moved + 2 * d.rounding;
  query.field.test_list(d, list);
  if (d.hit_count == 0 && !d.hits_only) {
    // The distance is that of the nearest point, which may be one of those that were left out.
    list.ways = nullptr;
    query.field.test_list(d, list);
  }
  d.rejected = std::max(-d.contact_distance, static_cast<float>(-cache.reach / d.unit) + moved + jump_of(query));
  std::copy(cache.flats.begin(), cache.flats.end(), d.flats);
  ask_flat_nodes(query, static_cast<std::uint32_t>(cache.flats.size()));
}

// Finds the points of a list. The field's error is for V, not for its bound in the region.
void find_within(TraverseQuery& query) noexcept {
  Descent& d = query.descent;
  const CodeBound* const region = d.region;
  CodeBound lower;
  if (region != nullptr) {
    lower = *region;
    lower.height -= jump_of(query);
    d.region = &lower;
  }
  (void)descend_in_blocks(query, 0, 0, query.shell.nodes);
  if (region != nullptr) d.rejected += jump_of(query);
  d.region = region;
}

void drop_hits_below(float least, Descent& d) noexcept {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < d.hit_count; ++i) {
    if (d.penetrations[i] < least) continue;
    d.hits[kept] = d.hits[i];
    for (float* const row : d.positions) {
      if (row != nullptr) row[kept] = row[i];
    }
    d.leaves[kept] = d.leaves[i];
    d.penetrations[kept++] = d.penetrations[i];
  }
  d.hit_count = kept;
}

}  // namespace

std::uint32_t find_all_hits(TraverseQuery& query) noexcept {
  if (!query.field.touches(query.descent, 0)) return 0;
  (void)descend_in_blocks(query, 0, 0, query.shell.nodes);
  ask_flat_nodes(query, query.descent.flat_count);
  return query.descent.end;
}

std::uint32_t find_hits_with(ContactCache& cache, TraverseQuery& query) noexcept {
  const PointshellView& shell = query.shell;
  Descent& d = query.descent;
  const bool same = cache.shell == shell.position[0] && cache.shell_points == shell.points &&
                    cache.shell_scale == shell.scale && cache.field == query.facts.id &&
                    cache.has_flats == (d.flats != nullptr);
  const double spent = same ? largest_change(shell, query.facts.values, cache.reference, query.pose) : 0;
  const double needed = query.reach + 2.0 * query.facts.error;
  const double step = same ? largest_change(shell, query.facts.values, cache.last, query.pose) : 0;
  cache.last = query.pose;
  // A list suffices for some steps like the last one.
  constexpr double kSteps = 8;
  const double least = 0.05 * shell.feature_covering_radius;
  const double most = 0.5 * shell.feature_covering_radius;
  const double room = std::clamp(kSteps * step, least, most);
  // That of a body which has become slow is longer than it has to be.
  if (same && cache.reach > 0 && cache.reach >= needed + spent && spent <= 2 * room) {
    test_remembered(cache, spent, query);
    return 0;
  }
  cache.shell = shell.position[0];
  cache.shell_points = shell.points;
  cache.shell_scale = shell.scale;
  cache.field = query.facts.id;
  cache.has_flats = d.flats != nullptr;
  cache.reference = query.pose;
  // A fast body gets no list, because it would be long, and a new pair none, because its speed is not known. Nor does a
  // list help where V is only an estimate.
  constexpr double kFewestSteps = 3;
  const double reach = needed + room;
  if (!same || kFewestSteps * step > most || reach > query.facts.certain) {
    cache.reach = 0;
    return find_all_hits(query);
  }
  const float wanted = d.contact_distance;
  d.contact_distance = static_cast<float>(reach / d.unit);
  if (query.field.touches(d, 0)) find_within(query);
  d.contact_distance = wanted;
  // Without memory for a list there is none.
  const bool is_remembered = try_to_grow([&] { remember_hits(query, cache); }) == Status::ok;
  cache.reach = is_remembered ? reach : 0;
  cache.touching = query.reach;
  drop_hits_below(-wanted, d);
  ask_flat_nodes(query, d.flat_count);
  return d.end;
}

}  // namespace vps::detail

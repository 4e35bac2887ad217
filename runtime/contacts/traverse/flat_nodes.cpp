// SPDX-License-Identifier: Zlib
// Flat nodes of the tree. Where the field is linear, the corners of a node's hull answer for all its points: a face on
// a face costs its rim, not its area. Beyond Algorithm 1 (Sec. 2.3). Proofs: docs/internals/bounds.md, "Flat nodes".
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/fields/linear_part.h"

namespace vps::detail {
namespace {

enum class Answer : std::uint8_t {
  given,   // by the node's corners or patch, which stand for all points below
  none,    // no point below is a hit
  far,     // ask the spheres below
  unknown  // ask the node's children
};

class FlatNodes {
 public:
  explicit FlatNodes(TraverseQuery& query) noexcept
      : query_(query),
        d_(query.descent),
        shell_(query.shell),
        tolerance_(tolerance_of(query)),
        limit_(query.options.contact_distance / query.descent.unit),
        gives_(query.flat_nodes_give) {}

  // Tests the corners of the first nodes of a list together, as many as there is room for: most nodes have a few.
  // @return how many nodes; `answer` then takes them one after the other
  std::uint32_t test(std::span<const std::uint32_t> nodes) noexcept {
    std::uint32_t corners = 0;
    std::uint32_t tested = 0;
    for (; tested < nodes.size(); ++tested) {
      const std::uint32_t node = nodes[tested];
      const std::uint32_t count = corners_of(node);
      if (corners + count > kMostCorners) break;
      const std::uint32_t* const points = shell_.hull_points + shell_.hull_offsets[node];
      for (std::uint32_t i = 0; i < count; ++i, ++corners) {
        points_[corners] = points[i];
        leaves_[corners] = node;
        for (std::size_t axis = 0; axis < 3; ++axis) codes_[axis][corners] = shell_.position[axis][points[i]];
      }
    }
    // Adds all corners to the hits, however far they are from the surface.
    first_ = d_.hit_count;
    next_ = 0;
    const float wanted = std::exchange(d_.contact_distance, std::numeric_limits<float>::max());
    const MovingShell* const moving = std::exchange(d_.moving, nullptr);
    query_.field.test_list(
        d_, {{codes_[0].data(), codes_[1].data(), codes_[2].data()}, points_.data(), leaves_.data(), corners});
    d_.contact_distance = wanted;
    d_.moving = moving;
    d_.hit_count = first_;
    return tested;
  }

  // Of the next of the nodes that were tested.
  Answer answer(std::uint32_t node) noexcept {
    begin_ = next_;
    count_ = corners_of(node);
    next_ += count_;
    if (count_ == 0) return Answer::unknown;
    const IndexRange below = points_below(shell_, node);
    most_tests_ = 4 * (below.end - below.begin);
    for (std::uint32_t i = 0; i < count_; ++i) {
      places_[i] = query_.transform.apply(point_position(shell_, points_[begin_ + i]));
    }
    const std::span<const float> v(d_.penetrations + first_ + begin_, count_);
    const Answer answer = answer_for(node, v);
    if (answer != Answer::given || gives_ == FlatNodesGive::patches) return answer;
    if (gives_ == FlatNodesGive::deepest) {
      keep_hit(static_cast<std::uint32_t>(std::max_element(v.begin(), v.end()) - v.begin()));
    } else {
      for (std::uint32_t i = 0; i < count_; ++i) keep_hit(i);
    }
    return answer;
  }

 private:
  static constexpr std::uint32_t kMostCorners = 64;
  static constexpr float kBeside = 4;  // V may be bent, and points may lie beside the hull. [tolerances]

  static float tolerance_of(const TraverseQuery& query) noexcept {
    const float of_hull = static_cast<float>(kHullTolerance) * query.shell.feature_covering_radius;
    if (query.flat_nodes_give == FlatNodesGive::patches) return of_hull;  // sums of all points are that close
    // V itself is rounded, and by as much at a corner of the hull.
    return query.facts.values.visit([&](const auto& field) { return std::max(of_hull, 2 * rounding_of(field)); });
  }

  // 0: the node's children are asked. A forged asset must not give more hits than there are points.
  [[nodiscard]] std::uint32_t corners_of(std::uint32_t node) const noexcept {
    const std::uint32_t count = shell_.hull_offsets[node + 1] - shell_.hull_offsets[node];
    const IndexRange below = points_below(shell_, node);
    return count > kMostCorners || count > below.end - below.begin ? 0 : count;
  }

  // Of the corners that were tested, brings one of the node's to the hits that stay.
  void keep_hit(std::uint32_t corner) noexcept {
    const std::uint32_t from = first_ + begin_ + corner;
    const std::uint32_t to = d_.hit_count++;
    d_.hits[to] = d_.hits[from];
    d_.leaves[to] = d_.leaves[from];
    d_.penetrations[to] = d_.penetrations[from];
    if (d_.positions[0] == nullptr) return;
    for (float* const row : d_.positions) row[to] = row[from];
  }

  // Largest distance off the surface at which a corner is a hit. In the field's unit.
  [[nodiscard]] float reach_of(std::size_t corner) const noexcept {
    if (d_.moving == nullptr) return limit_;
    const std::size_t at = begin_ + corner;
    const auto row = [&](const Affine& a, int axis) {
      const float* const r = a.rotation + 3 * axis;
      return a.translation[axis] + r[0] * codes_[0][at] + r[1] * codes_[1][at] + r[2] * codes_[2][at];
    };
    const Affine& ways = d_.moving->ways;
    const Vec3 way{row(ways, 0), row(ways, 1), row(ways, 2)};
    if (!d_.moving->is_upright) return d_.moving->near + length(way);
    const bool is_above = row(d_.points, 2) >= -query_.facts.below->thickness / 2;
    return d_.moving->near + std::max(0.0F, is_above ? -way.z : way.z);
  }

  // Whether no point below is a hit.
  // @param most     upper bound of V of these points. In the field's unit
  // @param most_by  the same near one of the corners
  template <class Bound>
  [[nodiscard]] bool is_apart(float most, const Bound& most_by) const noexcept {
    // The descent's distance: facets of points that are no contacts may reach into the field.
    if (d_.moving == nullptr) return most < -d_.contact_distance;
    // The sum of V and the length of the way, or the height that is lost, is convex.
    const float more = d_.moving->turn * kBeside * tolerance_ / d_.unit;
    for (std::size_t i = 0; i < count_; ++i) {
      if (!(most_by(i) + reach_of(i) + more < 0)) return false;
    }
    return true;
  }

  // Upper bound of V of the points below, as a look-up gives it, from the box around a map's surface: the upper face of
  // a plate on the ground lies within its sphere, but not in reach. In the field's unit.
  [[nodiscard]] float bound_by_box(const VoxelmapView& map) const noexcept {
    float low[3];
    float high[3];
    for (std::uint32_t i = 0; i < count_; ++i) {
      const float at[3] = {places_[i].x, places_[i].y, places_[i].z};
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = i == 0 ? at[axis] : std::min(low[axis], at[axis]);
        high[axis] = i == 0 ? at[axis] : std::max(high[axis], at[axis]);
      }
    }
    float squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float gap = std::max({low[axis] - map.bounds_max[axis], map.bounds_min[axis] - high[axis], 0.0F});
      squared += gap * gap;
    }
    const float v = kBeside * tolerance_ - std::sqrt(squared);
    // Beyond the band it comes from the far grid.
    const float far = std::min(v + query_.facts.far_error, -end_of_band(map.band_outer, map.voxel_size));
    return std::max(v + query_.facts.error, far) / d_.unit + d_.rounding;
  }
  template <class Field>
  [[nodiscard]] float bound_by_box(const Field&) const noexcept {
    return std::numeric_limits<float>::max();
  }
  // Beyond the band V is not linear, and small spheres are apart.
  [[nodiscard]] bool is_in_band(const VoxelmapView& map, float v) const noexcept {
    return d_.unit * v > -end_of_band(map.band_outer, map.voxel_size);
  }
  template <class Field>
  [[nodiscard]] bool is_in_band(const Field&, float) const noexcept {
    return true;
  }

  Answer answer_for(std::uint32_t node, std::span<const float> v) noexcept {
    const auto ends = std::minmax_element(v.begin(), v.end());
    const float shallowest = *ends.first;
    const float deepest = *ends.second;
    const auto at = static_cast<std::size_t>(ends.second - v.begin());
    return query_.facts.values.visit([&](const auto& field) {
      if (const float box = bound_by_box(field); is_apart(box, [box](std::size_t) { return box; })) {
        d_.rejected = std::max(d_.rejected, box);
        return Answer::none;
      }
      if (!is_in_band(field, deepest)) return Answer::far;
      if (!is_in_band(field, shallowest)) return Answer::unknown;
      LinearPart part = linear_part(field, places_[at], d_.unit * deepest);
      if (!fits(part, v)) part = fit_linear(field, part, {places_.data(), count_}, v, d_.unit);
      if (!fits(part, v) || !is_linear_between(field, part, {places_.data(), count_}, tolerance_, most_tests_)) {
        return Answer::unknown;
      }
      const float beside = kBeside * tolerance_ / d_.unit;
      const float most = deepest + beside;
      const bool apart = is_apart(most, [&](std::size_t i) { return v[i] + beside; });
      if (!apart) {
        const bool touches = gives_ == FlatNodesGive::deepest ? deepest >= -reach_of(at) : shallowest >= -limit_;
        if (!touches) return Answer::unknown;
        if (gives_ == FlatNodesGive::patches && !take_patch(node, part, shallowest, deepest)) return Answer::unknown;
      }
      d_.rejected = std::max(d_.rejected, most);
      return apart ? Answer::none : Answer::given;
    });
  }

  [[nodiscard]] bool fits(const LinearPart& part, std::span<const float> v) const noexcept {
    for (std::uint32_t i = 0; i < count_; ++i) {
      if (!(std::abs(d_.unit * v[i] - part.at(places_[i])) <= tolerance_)) return false;
    }
    return true;
  }

  // Writes the contacts of a node's patch. @return false without a patch, and where a force begins within the node
  bool take_patch(std::uint32_t node, const LinearPart& part, float shallowest, float deepest) noexcept {
    const std::span<const FlatPatch> all = query_.options.flat_patches;
    const auto patch = std::lower_bound(all.begin(), all.end(), node,
                                        [](const FlatPatch& one, std::uint32_t wanted) { return one.node < wanted; });
    if (patch == all.end() || patch->node != node || !(shallowest >= 0 || deepest < 0)) return false;
    Contact contacts[4];
    const Vec3 ways[4] = {patch->along, -1 * patch->along, patch->across, -1 * patch->across};
    const std::uint32_t first_point = points_below(shell_, node).begin;
    for (std::uint32_t i = 0; i < 4; ++i) {
      Contact& contact = contacts[i];
      contact.position = query_.transform.apply(patch->centre + ways[i]);
      contact.inward_normal = query_.transform.rotate(patch->inward_normal);
      contact.penetration = part.at(contact.position);
      contact.area = patch->area / 4;
      contact.point = std::min(first_point + i, shell_.points - 1);
      contact.node = node;
      if ((contact.penetration >= 0) != (shallowest >= 0)) return false;
    }
    for (const Contact& contact : contacts) take_contact(query_, contact);
    return true;
  }

  TraverseQuery& query_;
  Descent& d_;
  const PointshellView& shell_;
  const float tolerance_;  // of the hull, and of V from a linear function. [m]
  const float limit_;      // contact distance, in the field's unit
  const FlatNodesGive gives_;
  // Of the node that is answered: its corners among those that were tested.
  std::uint32_t begin_ = 0, count_ = 0, most_tests_ = 0;
  std::array<Vec3, kMostCorners> places_;  // of its corners, field's frame. [m]
  // Of the nodes that were tested: their first corner among the hits, and the first corner that is not answered yet.
  std::uint32_t first_ = 0, next_ = 0;
  std::array<std::array<float, kMostCorners + kLanePadding>, 3> codes_{};
  std::array<std::uint32_t, kMostCorners + kLanePadding> points_{}, leaves_{};
};

bool has_hull(const PointshellView& shell, std::uint32_t node) noexcept {
  return shell.hull_offsets[node] < shell.hull_offsets[node + 1];
}

}  // namespace

void stop_at_flat_nodes(TraverseQuery& query, Scratch& scratch, FlatNodesGive give) noexcept {
  if (query.shell.hull_offsets == nullptr || !query.facts.takes_lists || query.budget.limited()) return;
  query.descent.flats = scratch.flats;
  query.flat_nodes_give = give;
}

void ask_flat_nodes(TraverseQuery& query, std::uint32_t count) noexcept {
  if (count == 0) return;
  Descent& d = query.descent;
  const PointshellView& shell = query.shell;
  const std::uint32_t leaves = shell.level_offsets[shell.levels - 1];
  std::uint32_t* const flats = d.flats;
  d.flats = nullptr;  // the descent below stops at no node
  const std::uint32_t begin = d.begin;
  const std::uint32_t end = d.end;
  std::uint32_t tail = end;
  FlatNodes nodes(query);
  std::uint32_t tested = 0;
  for (std::uint32_t at = 0; at < count; ++at) {
    if (at == tested) tested += nodes.test({flats + at, count - at});
    const std::uint32_t node = flats[at];
    const Answer answer = nodes.answer(node);
    if (answer == Answer::given || answer == Answer::none) continue;
    const auto [first, last] = children_of(shell, node);
    if (answer == Answer::far || node >= leaves || first >= leaves) {
      d.queue[tail++] = node;
      continue;
    }
    const std::uint32_t touching = query.field.touching(d, {first, last}, d.queue + tail);
    for (std::uint32_t i = 0, from = tail; i < touching; ++i) {
      const std::uint32_t child = d.queue[from + i];
      if (has_hull(shell, child)) {
        flats[count++] = child;
      } else {
        d.queue[tail++] = child;
      }
    }
  }
  // Level by level from the last, as the descent takes what follows the first leaf of its queue for leaves. What one
  // level adds to the queue comes over the levels that are done.
  std::sort(d.queue + end, d.queue + tail);
  d.last_node = shell.nodes;
  for (std::uint32_t level = shell.levels; level-- > 0;) {
    d.begin = static_cast<std::uint32_t>(std::lower_bound(d.queue + end, d.queue + tail, shell.level_offsets[level]) -
                                         d.queue);
    d.end = tail;
    tail = d.begin;
    if (d.begin < d.end) query.field.descend(d);
  }
  d.begin = begin;
  d.end = end;
  d.flats = flats;
}

}  // namespace vps::detail

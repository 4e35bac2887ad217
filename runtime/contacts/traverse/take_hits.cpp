// SPDX-License-Identifier: Zlib
// Hits become contacts, and their force and torque are summed. Paper: Eq. (2), F = sum V n, and Eq. (3),
// T = sum P x V n, each term times the point's area with Weight::per_area. With Weight::per_patch the facets of a point
// are integrated one by one.
#include <algorithm>

#include "runtime/contacts/traverse/cut_facet.h"
#include "runtime/contacts/traverse/fill_contacts.h"
#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

// Writes in place: a copy would read what has just been written in other sizes, and wait for it.
void fill_contact(const TraverseQuery& query, const Transform& transform, HitsAre hits, std::uint32_t hit,
                  Contact& contact) noexcept {
  const std::uint32_t point = query.descent.hits[hit];
  contact.position = transform.apply(point_position(query.shell, point));
  contact.inward_normal = transform.rotate(point_inward_normal(query.shell, point));
  contact.penetration = query.descent.unit * query.descent.penetrations[hit];
  contact.point = point;
  contact.node = query.descent.leaves[hit];
  contact.area = hits == HitsAre::nodes ? query.options.node_areas[contact.node] : point_area(query.shell, point);
}
Contact contact_of(const TraverseQuery& query, const Transform& transform, HitsAre hits, std::uint32_t hit) noexcept {
  Contact contact;
  fill_contact(query, transform, hits, hit, contact);
  return contact;
}

// Eqs. (2) and (3). The sums stay in registers while the hits of a block are taken.
class ForceSum {
 public:
  explicit ForceSum(const TraverseQuery& query) noexcept
      : is_wanted_(!query.descent.hits_only),
        has_areas_(query.options.weight != Weight::per_point),
        centre_of_mass_(query.centre_of_mass) {
    std::copy_n(query.result.force, 3, force_);
    std::copy_n(query.result.torque, 3, torque_);
  }
  [[nodiscard]] bool is_wanted() const noexcept { return is_wanted_; }
  void add(const Contact& contact) noexcept {
    if (!is_wanted_) return;
    const double weight = has_areas_ ? contact.area : 1.0;
    const double scale = weight * contact.penetration;
    const double f[3] = {scale * contact.inward_normal.x, scale * contact.inward_normal.y,
                         scale * contact.inward_normal.z};
    const Vec3 arm = contact.position - centre_of_mass_;
    for (int axis = 0; axis < 3; ++axis) force_[axis] += f[axis];
    torque_[0] += arm.y * f[2] - arm.z * f[1];
    torque_[1] += arm.z * f[0] - arm.x * f[2];
    torque_[2] += arm.x * f[1] - arm.y * f[0];
  }
  void store(QueryResult& result) const noexcept {
    std::copy_n(force_, 3, result.force);
    std::copy_n(torque_, 3, result.torque);
  }

 private:
  const bool is_wanted_, has_areas_;
  const Vec3 centre_of_mass_;
  double force_[3], torque_[3];
};

// Facets [first, last) of a hit's point.
struct FacetRange {
  std::uint32_t first = 0, last = 0;
};

// Finds the facets of hits. These are in the order of their points, but for those below flat nodes, which come last.
class FacetsOfHits {
 public:
  explicit FacetsOfHits(const TraverseQuery& query, HitsAre hits) noexcept
      : points_(query.shell.facet_points),
        count_(query.has_facets && hits == HitsAre::points ? query.shell.facets : 0) {}
  FacetRange next(std::uint32_t point) noexcept {
    if (at_ > 0 && points_[at_ - 1] >= point) at_ = 0;
    if (at_ < count_ && points_[at_] < point) {
      at_ = static_cast<std::uint32_t>(std::lower_bound(points_ + at_, points_ + count_, point) - points_);
    }
    FacetRange range{at_, at_};
    while (range.last < count_ && points_[range.last] == point) ++range.last;
    return range;
  }

 private:
  const std::uint32_t* const points_;
  const std::uint32_t count_;
  std::uint32_t at_ = 0;
};

// The part of a facet in contact, with the point's numbers in `contact`.
bool cut(const TraverseQuery& query, const Transform& transform, std::uint32_t facet, Contact& contact) noexcept {
  const float step = query.shell.covering_radius / kFacetSteps;
  const std::int8_t* const codes = query.shell.facet_corners + 12 * std::size_t{facet};
  const Vec3 point = point_position(query.shell, contact.point);
  const Vec3 normal = contact.inward_normal;
  Vec3 corners[4];
  float v[4];
  for (std::size_t i = 0; i < 4; ++i) {
    const std::int8_t* const c = codes + 3 * i;
    corners[i] = transform.apply(point + Vec3{step * c[0], step * c[1], step * c[2]});
    v[i] = penetration(query.facts.values, corners[i], normal);
  }
  return cut_facet(corners, v, contact);
}

// The deepest of hits [first, last), for a segment without facets. Only those that touch have forces.
void take_segment_hits(TraverseQuery& query, HitsAre hits, std::uint32_t first, std::uint32_t last) noexcept {
  const Descent& d = query.descent;
  ForceSum sum(query);
  std::uint32_t deepest = last;
  float most = query.segment->penetration / d.unit;
  for (std::uint32_t i = first; i < last; ++i) {
    if (query.is_left_out(d.hits[i])) continue;
    const float v = d.penetrations[i];
    if (v >= 0 && sum.is_wanted()) sum.add(contact_of(query, query.transform, hits, i));
    if (!(v > most)) continue;
    most = v;
    deepest = i;
  }
  sum.store(query.result);
  if (deepest < last) *query.segment = contact_of(query, query.transform, hits, deepest);
}

// Every hit is a contact. @return the first hit without room
std::uint32_t take_points(TraverseQuery& query, std::uint32_t first, std::uint32_t last) noexcept {
  const Descent& d = query.descent;
  ForceSum sum(query);
  const std::size_t room = query.out.size() - std::min<std::size_t>(query.result.contacts, query.out.size());
  last = first + static_cast<std::uint32_t>(std::min<std::size_t>(last - first, room));
  constexpr std::uint32_t kBlock = 256;  // stays in the cache until it is summed
  while (first < last) {
    const std::uint32_t count = std::min(last - first, kBlock);
    Contact* const out = query.out.data() + query.result.contacts;
    fill_contacts(query.shell, query.transform, {d.hits + first, d.leaves + first, d.penetrations + first, d.unit},
                  count, out);
    for (std::uint32_t i = 0; i < count; ++i) {
      if (out[i].penetration >= 0) sum.add(out[i]);
    }
    query.result.contacts += count;
    first += count;
  }
  sum.store(query.result);
  return first;
}

}  // namespace

void take_contact(TraverseQuery& query, const Contact& contact) noexcept {
  write_contact(query, contact);
  if (contact.penetration < 0) return;
  ForceSum sum(query);
  sum.add(contact);
  sum.store(query.result);
}

void take_hits(TraverseQuery& query, HitsAre hits) noexcept {
  const bool dropped = hits == HitsAre::nodes && query.options.node_areas.empty();
  take_hits(query, hits, 0, dropped ? 0 : query.descent.hit_count);
  query.descent.hit_count = 0;
}

void take_hits(TraverseQuery& query, HitsAre hits, std::uint32_t first, std::uint32_t last) noexcept {
  if (query.segment != nullptr && !query.has_facets) return take_segment_hits(query, hits, first, last);
  if (hits == HitsAre::points && !query.has_facets && !query.options.leaves_faces) {
    first = take_points(query, first, last);
  }
  // Copies, because the compiler must assume that writing a contact changes the originals.
  const Transform transform = query.transform;
  const std::span<Contact> out = query.out;
  std::uint32_t found = query.result.contacts;
  Contact* const segment = query.segment;
  const float limit = query.has_facets ? -query.options.contact_distance / query.descent.unit : kNothingTested;
  FacetsOfHits facets(query, hits);
  const auto write = [&](const Contact& contact) {
    if (found < out.size()) out[found] = contact;
    ++found;
  };
  Contact beyond;  // where there is no more room
  ForceSum sum(query);
  const float unit = query.descent.unit;
  for (std::uint32_t i = first; i < last; ++i) {
    if (query.is_left_out(query.descent.hits[i])) continue;
    const FacetRange range = facets.next(query.descent.hits[i]);
    const bool is_near = query.descent.penetrations[i] >= limit;
    if (!is_near && range.first == range.last) continue;
    // Of a segment's points that do not touch, most are not its deepest: they need no contact.
    const float penetration = unit * query.descent.penetrations[i];
    const bool is_deepest = segment == nullptr || penetration > segment->penetration;
    if (range.first == range.last && penetration < 0 && !is_deepest) continue;
    if (segment == nullptr && range.first == range.last) {
      Contact& contact = found < out.size() ? out[found] : beyond;
      fill_contact(query, transform, hits, i, contact);
      ++found;
      if (penetration >= 0) sum.add(contact);
      continue;
    }
    Contact contact = contact_of(query, transform, hits, i);
    bool is_cut = false;
    for (std::uint32_t facet = range.first; facet < range.last; ++facet) {
      Contact part = contact;
      if (!cut(query, transform, facet, part)) continue;
      sum.add(part);
      is_cut = true;
      if (segment == nullptr) write(part);
    }
    if (range.first != range.last) {
      contact.area = 0;  // its facets have it
    } else if (contact.penetration >= 0) {
      sum.add(contact);
    }
    if (segment == nullptr) {
      if (is_near && !is_cut) write(contact);
    } else if (is_near && is_deepest) {
      *segment = contact;
    }
  }
  sum.store(query.result);
  query.result.contacts = found;
}

}  // namespace vps::detail

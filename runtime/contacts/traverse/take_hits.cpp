// SPDX-License-Identifier: Zlib
// Hits become contacts, and their force and torque are summed. Paper: Eq. (2), F = sum V n, and Eq. (3),
// T = sum P x V n, each term times the point's area with Weight::per_area.
#include <algorithm>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

Contact contact_of(const TraverseQuery& query, const Transform& transform, HitsAre hits, std::uint32_t hit) noexcept {
  const std::uint32_t point = query.descent.hits[hit];
  Contact contact;
  contact.position = transform.apply(point_position(query.shell, point));
  contact.inward_normal = transform.rotate(point_inward_normal(query.shell, point));
  contact.penetration = query.descent.unit * query.descent.penetrations[hit];
  contact.point = point;
  contact.node = query.descent.leaves[hit];
  contact.area = hits == HitsAre::nodes ? query.options.node_areas[contact.node] : point_area(query.shell, point);
  return contact;
}

// Eqs. (2) and (3). The sums stay in registers while the hits of a block are taken.
class ForceSum {
 public:
  explicit ForceSum(const TraverseQuery& query) noexcept
      : per_area_(query.options.weight == Weight::per_area), centre_of_mass_(query.centre_of_mass) {
    std::copy_n(query.result.force, 3, force_);
    std::copy_n(query.result.torque, 3, torque_);
  }
  void add(const Contact& contact) noexcept {
    const double weight = per_area_ ? contact.area : 1.0;
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
  const bool per_area_;
  const Vec3 centre_of_mass_;
  double force_[3], torque_[3];
};

}  // namespace

void take_hits(TraverseQuery& query, HitsAre hits) noexcept {
  const bool dropped = hits == HitsAre::nodes && query.options.node_areas.empty();
  const std::uint32_t count = dropped ? 0 : query.descent.hit_count;
  // Copies, because the compiler must assume that writing a contact changes the originals.
  const Transform transform = query.transform;
  const std::span<Contact> out = query.out;
  std::uint32_t found = query.result.contacts;
  Contact* const segment = query.segment;
  ForceSum sum(query);
  const float unit = query.descent.unit;
  for (std::uint32_t i = 0; i < count; ++i) {
    // Of the points of a segment that do not touch, most are not its deepest: they need no contact.
    const float penetration = unit * query.descent.penetrations[i];
    if (segment != nullptr && penetration < 0 && penetration <= segment->penetration) continue;
    const Contact contact = contact_of(query, transform, hits, i);
    if (contact.penetration >= 0) sum.add(contact);
    if (segment == nullptr) {
      if (found < out.size()) out[found] = contact;
      ++found;
    } else if (contact.penetration > segment->penetration) {
      *segment = contact;
    }
  }
  sum.store(query.result);
  query.result.contacts = found;
  query.descent.hit_count = 0;
}

}  // namespace vps::detail

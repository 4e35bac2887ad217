// SPDX-License-Identifier: Zlib
// Hits become contacts, and their force and torque are summed. Paper: Eq. (2), F = sum V n, and Eq. (3),
// T = sum P x V n, each term times the point's area with Weight::per_area.
#include "runtime/contacts/traverse/traverse_query.h"

namespace vps::detail {
namespace {

Contact contact_of(const TraverseQuery& query, HitsAre hits, std::uint32_t hit) noexcept {
  const std::uint32_t point = query.descent.hits[hit];
  Contact contact;
  contact.position = query.transform.apply(point_position(query.shell, point));
  contact.inward_normal = query.transform.rotate(point_inward_normal(query.shell, point));
  contact.penetration = query.descent.unit * query.descent.penetrations[hit];
  contact.point = point;
  contact.node = query.descent.leaves[hit];
  contact.area = hits == HitsAre::nodes ? query.options.node_areas[contact.node] : point_area(query.shell, point);
  return contact;
}

void add_force(TraverseQuery& query, const Contact& contact) noexcept {
  const double weight = query.options.weight == Weight::per_area ? contact.area : 1.0;
  const double scale = weight * contact.penetration;
  const double f[3] = {scale * contact.inward_normal.x, scale * contact.inward_normal.y,
                       scale * contact.inward_normal.z};
  const Vec3 arm = contact.position - query.centre_of_mass;
  QueryResult& result = query.result;
  for (int axis = 0; axis < 3; ++axis) result.force[axis] += f[axis];
  result.torque[0] += arm.y * f[2] - arm.z * f[1];
  result.torque[1] += arm.z * f[0] - arm.x * f[2];
  result.torque[2] += arm.x * f[1] - arm.y * f[0];
}

}  // namespace

void write_contact(TraverseQuery& query, const Contact& contact) noexcept {
  if (query.result.contacts < query.out.size()) query.out[query.result.contacts] = contact;
  ++query.result.contacts;
}

void take_hits(TraverseQuery& query, HitsAre hits) noexcept {
  const bool dropped = hits == HitsAre::nodes && query.options.node_areas.empty();
  const std::uint32_t count = dropped ? 0 : query.descent.hit_count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Contact contact = contact_of(query, hits, i);
    if (contact.penetration >= 0) add_force(query, contact);
    if (query.segment == nullptr) {
      write_contact(query, contact);
    } else if (contact.penetration > query.segment->penetration) {
      *query.segment = contact;
    }
  }
  query.descent.hit_count = 0;
}

}  // namespace vps::detail

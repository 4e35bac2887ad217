// SPDX-License-Identifier: Zlib
// Looks up each corner in the distance field of the baked body. Paper: Sec. 2.2, with the roles of the bodies
// exchanged.
#include "runtime/bullet/partners/corner_contacts.h"

#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>

#include "runtime/fields/penetration.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {

using detail::operator+;
using detail::operator-;
using detail::operator*;

MapPlace place_in_map(const VoxelmapView& map, Vec3 point) {
  const Vec3 outward = outward_normal(map, point);
  const float v = penetration(map, point, outward);
  ClosestPoint closest;
  // Near the end of the band and beyond, V and its gradient are rough.
  if (v < -0.75F * map.band_outer && closest_point(map, point, {}, closest) == Status::ok && closest.converged &&
      closest.distance > 0) {
    return {-closest.distance, (1 / closest.distance) * (point - closest.position), true};
  }
  return {v, outward, false};
}

bool add_corner_contacts(const Pair& pair, const btTransform& frame, float reach, std::vector<Contact>& contacts) {
  const int type = pair.field.shape->getShapeType();
  if (type != BOX_SHAPE_PROXYTYPE && type != CONVEX_HULL_SHAPE_PROXYTYPE) return false;
  const VoxelmapView& map = pair.shell.vps->distances();
  if (map.field == Field::none) return false;
  const PointshellView& shell = pair.shell.vps->pointshell();
  const auto& solid = static_cast<const btPolyhedralConvexShape&>(*pair.field.shape);
  if (static_cast<std::uint32_t>(solid.getNumVertices()) > kMostCorners) return false;
  // The corners of a box are those of its faces; a hull is rounded by its margin.
  const float margin = type == BOX_SHAPE_PROXYTYPE ? 0 : static_cast<float>(solid.getMargin());
  const Vec3 centre = sphere_centre(shell, 0);
  const float farthest = sphere_radius(shell, 0) + reach + margin;
  const std::size_t before = contacts.size();
  const detail::Transform to_map = to_asset(pair, frame);
  for (int i = 0; i < solid.getNumVertices(); ++i) {
    btVector3 vertex;
    solid.getVertex(i, vertex);
    const Vec3 corner = to_vec3(vertex);
    const Vec3 at = to_map.apply(corner);
    const Vec3 away = at - centre;
    if (!(detail::dot(away, away) <= farthest * farthest) || penetration(map, at, {}) + margin < -reach) continue;
    const MapPlace place = place_in_map(map, at);
    if (place.penetration + margin < -reach || !(detail::dot(place.outward, place.outward) > 0)) continue;
    Contact contact;
    contact.inward_normal = -1.0F * to_map.rotate_back(place.outward);
    contact.position = corner - place.penetration * contact.inward_normal;
    contact.penetration = place.penetration + margin;
    contact.point = shell.points + static_cast<std::uint32_t>(i);
    contacts.push_back(contact);
  }
  return contacts.size() > before;
}

}  // namespace vps::bullet

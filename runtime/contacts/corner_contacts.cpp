// SPDX-License-Identifier: Zlib
// Looks up each corner in the distance field of the baked body. Paper: Sec. 2.2, with the roles of the bodies
// exchanged.
#include "runtime/contacts/corner_contacts.h"

#include <type_traits>

#include "runtime/contacts/refine_contact.h"
#include "runtime/contacts/step_pair.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {

void set_corners(std::array<Vec3, 8>& room, Partner& partner) noexcept {
  partner.field.visit([&](const auto& body) {
    using Kind = std::remove_cvref_t<decltype(body)>;
    if constexpr (std::is_same_v<Kind, BoxField>) {
      const Vec3 h = body.half_extents;
      for (std::size_t i = 0; i < room.size(); ++i) {
        room[i] = {(i & 1) != 0 ? -h.x : h.x, (i & 2) != 0 ? -h.y : h.y, (i & 4) != 0 ? -h.z : h.z};
      }
      partner.corners.places = partner.hull.places = room;
    }
    if constexpr (std::is_same_v<Kind, RevolvedField>) {
      if (body.profile != RevolvedField::Profile::cone) return;
      room[0] = {0, 0, body.half_height};
      partner.corners = {{room.data(), 1}, body.rounding};
    }
  });
}

void add_corner_contact(const VoxelmapView& map, const Transform& to_map, Vec3 corner, CornerReach reach,
                        std::uint32_t number, std::vector<Contact>& contacts) {
  // The normals of the corner's own sides say nothing of where it meets a face.
  const MapPlace place = place_in_map(map, to_map.apply(corner));
  if (!(place.penetration >= reach.least) || !(dot(place.outward, place.outward) > 0)) return;
  Contact contact;
  contact.inward_normal = -1.0F * to_map.rotate_back(place.outward);
  contact.position = corner - place.penetration * contact.inward_normal;
  contact.penetration = place.penetration + reach.margin;
  contact.point = number;
  contacts.push_back(contact);
}

bool add_corner_contacts(const VoxelmapView& map, const PointshellView& shell, const Transform& to_map,
                         const Corners& corners, float reach, std::vector<Contact>& contacts) {
  const Vec3 centre = sphere_centre(shell, 0);
  const float of_shell = sphere_radius(shell, 0) + reach;
  const std::size_t before = contacts.size();
  for (std::size_t i = 0; i < corners.places.size(); ++i) {
    const float rounding = corners.rounding(i);
    const float farthest = of_shell + rounding;
    const Vec3 at = to_map.apply(corners.places[i]);
    const Vec3 away = at - centre;
    if (!(dot(away, away) <= farthest * farthest) || vps::penetration(map, at, {}) + rounding < -reach) continue;
    add_corner_contact(map, to_map, corners.places[i], {-reach - rounding, rounding},
                       shell.points + static_cast<std::uint32_t>(i), contacts);
  }
  return contacts.size() > before;
}

}  // namespace vps::detail

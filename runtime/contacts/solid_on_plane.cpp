// SPDX-License-Identifier: Zlib
// Looks up the places of a solid that may be its deepest in the plane of flat baked ground.
#include "runtime/contacts/solid_on_plane.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "runtime/contacts/wide_face.h"
#include "runtime/fields/analytic_fields.h"

namespace vps::detail {
namespace {

// The deepest place of a solid in a half space is within `thickness` of one of them.
struct Outermost {
  std::array<Vec3, kMostCorners> places;  // solid's frame. [m]
  std::size_t count = 0;
  float thickness = 0;  // [m]
  void add(Vec3 place) { places[count++] = place; }
};

float longest_side(const VoxelmapView& map) {
  float longest = 0;
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, map.bounds_max[axis] - map.bounds_min[axis]);
  return longest;
}

// Four places of a rim, of which the first is the deepest.
void add_rim(float radius, float height, Vec3 down, Outermost& out) {
  const float across = std::hypot(down.x, down.y);
  constexpr float kUpright = 1e-3F;  // the deepest place of a level rim is any
  const Vec3 u = across > kUpright ? (radius / across) * Vec3{down.x, down.y, 0} : Vec3{radius, 0, 0};
  const Vec3 v{-u.y, u.x, 0};
  for (const Vec3 place : {u, v, -1.0F * u, -1.0F * v}) out.add(place + Vec3{0, 0, height});
}

// How far a solid reaches from its frame's origin. Nothing where that is more than `most`, or the solid is another. [m]
std::optional<float> radius_of(const Partner& partner, float most) {
  float radius = 0;
  for (const Vec3 corner : partner.corners.places) {
    radius = std::max(radius, length(corner) + partner.corners.margin);
    if (!(radius <= most)) return {};
  }
  if (partner.corners.places.empty()) {
    partner.field.visit([&](const auto& field) {
      using Kind = std::remove_cvref_t<decltype(field)>;
      if constexpr (std::is_same_v<Kind, SphereField>) radius = field.radius;
      if constexpr (std::is_same_v<Kind, RevolvedField>) {
        const bool is_capsule = field.profile == RevolvedField::Profile::capsule;
        radius = field.rounding +
                 (is_capsule ? field.half_height + field.radius : std::hypot(field.half_height, field.radius));
      }
    });
  }
  return radius > 0 && radius <= most ? std::optional(radius) : std::nullopt;
}

// @param down  into the ground, solid's frame, unit
Outermost outermost_of(const Partner& partner, Vec3 down) {
  Outermost out;
  if (!partner.corners.places.empty()) {
    for (const Vec3 corner : partner.corners.places) out.add(corner);
    out.thickness = partner.corners.margin;
    return out;
  }
  partner.field.visit([&](const auto& field) {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, SphereField>) {
      out.thickness = field.radius;
      out.add({});
    }
    if constexpr (std::is_same_v<Kind, RevolvedField>) {
      using Profile = RevolvedField::Profile;
      const Vec3 top{0, 0, field.half_height};
      out.thickness = field.rounding;
      if (field.profile == Profile::capsule) {
        out.thickness += field.radius;
        out.add(-1.0F * top);
      } else {
        add_rim(field.radius, -field.half_height, down, out);
      }
      if (field.profile == Profile::cylinder) {
        add_rim(field.radius, field.half_height, down, out);
      } else {
        out.add(top);
      }
    }
  });
  return out;
}

}  // namespace

std::optional<float> add_contacts_on_plane(const StepPair& pair, const Partner& partner, float distance,
                                           GroundMemory& memory, std::vector<Contact>& contacts) {
  // On a larger body the shell's is a foot.
  const std::optional<float> radius = radius_of(partner, longest_side(pair.distances) / 2);
  if (!radius) return {};
  const Transform to_shell = pair.to_shell();
  const HalfSpaceField* const plane = flat_around(pair.distances, to_shell.apply({}), *radius + distance, memory);
  if (plane == nullptr) return {};
  const Vec3 down = -1.0F * to_shell.rotate_back(plane->outward_normal);
  const Outermost outermost = outermost_of(partner, down);
  float most = -distance;
  for (std::size_t i = 0; i < outermost.count; ++i) {
    const Vec3 place = outermost.places[i];
    const float v = value_at(*plane, to_shell.apply(place));
    Contact contact;
    contact.penetration = v + outermost.thickness;
    most = std::max(most, contact.penetration);
    if (!(contact.penetration >= -distance)) continue;
    contact.inward_normal = down;
    contact.position = place - v * down;
    contact.point = pair.shell.points + static_cast<std::uint32_t>(i);
    contacts.push_back(contact);
  }
  return most;
}

}  // namespace vps::detail

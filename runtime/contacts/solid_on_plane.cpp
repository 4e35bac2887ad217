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

// Four places of a rim, of which the first is the deepest.
void add_rim(float radius, float height, Vec3 down, Outermost& out) {
  const float across = std::hypot(down.x, down.y);
  constexpr float kUpright = 1e-3F;  // the deepest place of a level rim is any
  const Vec3 u = across > kUpright ? (radius / across) * Vec3{down.x, down.y, 0} : Vec3{radius, 0, 0};
  const Vec3 v{-u.y, u.x, 0};
  for (const Vec3 place : {u, v, -1.0F * u, -1.0F * v}) out.add(place + Vec3{0, 0, height});
}

// A ball that holds a solid, solid's frame. [m]
struct Ball {
  Vec3 centre;
  float radius = 0;  // 0: the solid is another
};
Ball ball_around(const Partner& partner) {
  Ball ball;
  const std::span<const Vec3> corners = partner.corners.places;
  if (!corners.empty()) {
    Vec3 low = corners[0];
    Vec3 high = corners[0];
    for (const Vec3 corner : corners) {
      low = {std::min(low.x, corner.x), std::min(low.y, corner.y), std::min(low.z, corner.z)};
      high = {std::max(high.x, corner.x), std::max(high.y, corner.y), std::max(high.z, corner.z)};
    }
    return {0.5F * (low + high), 0.5F * length(high - low) + partner.corners.margin};
  }
  partner.field.visit([&](const auto& field) {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, SphereField>) ball.radius = field.radius;
    if constexpr (std::is_same_v<Kind, RevolvedField>) {
      const bool is_capsule = field.profile == RevolvedField::Profile::capsule;
      ball.radius = field.rounding +
                    (is_capsule ? field.half_height + field.radius : std::hypot(field.half_height, field.radius));
    }
  });
  return ball;
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
  const VoxelmapView& map = pair.distances;
  const Ball ball = ball_around(partner);
  // Around a large solid few bodies are flat, and to find that out takes longer than to look up the contacts.
  constexpr float kLargest_vx = 48;
  const float most_radius = std::min(longest_side(map) / 2, kLargest_vx * map.voxel_size);
  if (!(ball.radius > 0 && ball.radius <= most_radius) || pair.shell.points == 0) return {};
  if (check_pose(pair.shell_to_field) != Status::ok) return {};
  const Transform to_shell = pair.to_shell();
  constexpr float kSlow_vx = 6;
  const bool is_slow = distance < kSlow_vx * map.voxel_size;
  const HalfSpaceField* const plane =
      flat_around(map, to_shell.apply(ball.centre), kStretch * ball.radius + distance, is_slow, memory);
  if (plane == nullptr) return {};
  const Vec3 down = -1.0F * to_shell.rotate_back(plane->outward_normal);
  const Outermost outermost = outermost_of(partner, down);
  constexpr float kNear_vx = 0.2F;  // of the plane and the samples
  float most = -distance;
  for (std::size_t i = 0; i < outermost.count; ++i) {
    const Vec3 place = outermost.places[i];
    const float v = value_at(*plane, to_shell.apply(place));
    Contact contact;
    contact.penetration = v + outermost.thickness;
    most = std::max(most, contact.penetration + kNear_vx * map.voxel_size);
    if (!(contact.penetration >= -distance)) continue;
    contact.inward_normal = down;
    contact.position = place - v * down;
    contact.point = pair.shell.points + static_cast<std::uint32_t>(i);
    contacts.push_back(contact);
  }
  return most;
}

}  // namespace vps::detail

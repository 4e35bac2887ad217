// SPDX-License-Identifier: Zlib
// Looks up the places of a solid that may be its deepest in the plane of baked ground.
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

// A solid over a plane.
struct Over {
  const StepPair& pair;
  const HalfSpaceField& plane;  // map's frame
  const Transform& to_map;      // takes the solid's frame there
  const Outermost& outermost;
  Vec3 down;  // into the ground, solid's frame, unit

  [[nodiscard]] float depth(Vec3 place) const { return value_at(plane, to_map.apply(place)) + outermost.thickness; }
  // @param number  of the place, of all that the solid may have
  [[nodiscard]] Contact contact(Vec3 place, std::size_t number) const {
    Contact contact;
    contact.penetration = depth(place);
    contact.inward_normal = down;
    contact.position = place - (contact.penetration - outermost.thickness) * down;
    contact.point = pair.shell.points + static_cast<std::uint32_t>(number);
    return contact;
  }
};

// Where a solid that stands on a plane over tops has ground: of the corners of its face, and of places on the lines
// between these. Nothing where it does not stand there, but in a hole or on an edge.
bool add_standing(const Over& over, std::vector<Contact>& contacts) {
  constexpr float kDeep_vx = 0.5F;
  constexpr std::size_t kMostTested = 64;
  const VoxelmapView& map = over.pair.distances;
  std::array<std::size_t, kMostCorners> corners{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < over.outermost.count; ++i) {
    const float depth = over.depth(over.outermost.places[i]);
    if (depth > kDeep_vx * map.voxel_size) return false;
    if (depth >= -over.pair.touching()) corners[count++] = i;
  }
  if (count < 3) return false;
  std::size_t tested = 0;
  bool is_lower = false;  // it may touch lower ground
  const auto test = [&](Vec3 place, std::size_t number) {
    if (tested == kMostTested) return;
    ++tested;
    const Vec3 at = over.to_map.apply(place);
    if (has_ground(map, over.plane, at)) return contacts.push_back(over.contact(place, number));
    const Vec3 lowest = at - over.outermost.thickness * over.plane.outward_normal;
    is_lower = is_lower || voxelmap_penetration(map, lowest, {}) >= -over.pair.touching();
  };
  const auto corner = [&](std::size_t i) { return over.outermost.places[corners[i]]; };
  for (std::size_t i = 0; i < count; ++i) test(corner(i), corners[i]);
  std::size_t first = kMostCorners;
  for (const float part : {0.5F, 0.25F, 0.75F}) {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        test(corner(k) + part * (corner(i) - corner(k)), first + kMostCorners * corners[i] + corners[k]);
      }
    }
    first += std::size_t{kMostCorners} * kMostCorners;
  }
  return !is_lower && contacts.size() >= 3 && 2 * contacts.size() >= tested;
}

}  // namespace

std::optional<float> add_contacts_on_plane(const StepPair& pair, const Partner& partner, float distance,
                                           PairMemory& memory, std::vector<Contact>& contacts) {
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
  const Vec3 centre = to_shell.apply(ball.centre);
  const float reach = kStretch * ball.radius + distance;
  const auto moves_on = [&](const HalfSpaceField& tops) {
    const Vec3 normal = Transform(pair.shell_pose).rotate(tops.outward_normal);
    return moves_along(*pair.field_motion, *pair.shell_motion, normal, map.voxel_size);
  };
  const HalfSpaceField* plane = flat_around(map, centre, reach, is_slow, memory.ground);
  const bool is_flat = plane != nullptr;
  if (!is_flat && memory.lay_flat() && pair.shell_motion != nullptr) {
    plane = tops_around(map, centre, reach, memory.ground);
    if (plane != nullptr && !moves_on(*plane)) return {};
  }
  if (plane == nullptr) return {};
  const Vec3 down = -1.0F * to_shell.rotate_back(plane->outward_normal);
  const Outermost outermost = outermost_of(partner, down);
  const Over over{pair, *plane, to_shell, outermost, down};
  if (!is_flat && !add_standing(over, contacts)) {
    contacts.clear();
    return {};
  }
  constexpr float kNear_vx = 0.2F;  // of the plane and the samples
  float most = -distance;
  for (std::size_t i = 0; i < outermost.count; ++i) {
    const Contact contact = over.contact(outermost.places[i], i);
    most = std::max(most, contact.penetration + kNear_vx * map.voxel_size);
    if (is_flat && contact.penetration >= -distance) contacts.push_back(contact);
  }
  return most;
}

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
// Looks up the places of a solid that may be its deepest in the plane of baked ground.
#include "runtime/contacts/solid_on_plane.h"

#include <algorithm>
#include <array>
#include <bit>
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
  Outermost outermost;
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

constexpr float kIntoTops_vx = 0.5F;  // in the plane over tops a solid that stands on them is no deeper

// The face on which a solid may stand: its corners, and places on the lines between these.
struct Face {
  static constexpr std::size_t kMost = 64;
  std::uint32_t corners = 0;  // bits of outermost places
  std::array<Vec3, kMost> places;
  std::array<std::size_t, kMost> numbers;
  std::size_t count = 0;

  void add(Vec3 place, std::size_t number) {
    if (count == kMost) return;
    places[count] = place;
    numbers[count++] = number;
  }
};

// The face that touches a plane; an empty one if the solid is deep in it, or has no face there.
Face face_on(const Over& over) {
  Face face;
  for (std::size_t i = 0; i < over.outermost.count; ++i) {
    const float depth = over.depth(over.outermost.places[i]);
    if (depth > kIntoTops_vx * over.pair.distances.voxel_size) return {};
    if (!(depth >= -over.pair.touching())) continue;
    face.add(over.outermost.places[i], i);
    face.corners |= 1U << i;
  }
  const std::size_t corners = face.count;
  if (corners < 3) return {};
  std::size_t first = kMostCorners;
  for (const float part : {0.5F, 0.25F, 0.75F}) {
    for (std::size_t i = 0; i < corners; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        face.add(face.places[k] + part * (face.places[i] - face.places[k]),
                 first + kMostCorners * face.numbers[i] + face.numbers[k]);
      }
    }
    first += std::size_t{kMostCorners} * kMostCorners;
  }
  return face;
}

// Which places of a face have ground below them; 0 where the solid does not stand on it, but in a hole or on an edge.
std::uint64_t find_ground(const Over& over, const Face& face) {
  const VoxelmapView& map = over.pair.distances;
  std::uint64_t grounded = 0;
  for (std::size_t i = 0; i < face.count; ++i) {
    const Vec3 at = over.to_map.apply(face.places[i]);
    if (has_ground(map, over.plane, at)) {
      grounded |= std::uint64_t{1} << i;
      continue;
    }
    // It may touch lower ground.
    const Vec3 lowest = at - over.outermost.thickness * over.plane.outward_normal;
    if (voxelmap_penetration(map, lowest, {}) >= -over.pair.touching()) return 0;
  }
  const auto most = static_cast<std::size_t>(std::popcount(grounded));
  return most >= 3 && 2 * most >= face.count ? grounded : 0;
}

// @return whether the solid stands on the plane over tops
bool add_standing(const Over& over, TopsMemory& memory, std::vector<Contact>& contacts) {
  const Face face = face_on(over);
  if (face.count == 0) return false;
  if (memory.corners != face.corners || !stands_still(over.pair, memory.stand)) {
    memory = {over.pair.shell_to_field, false, face.corners, find_ground(over, face)};
  }
  for (std::size_t i = 0; i < face.count; ++i) {
    if ((memory.grounded >> i & 1) != 0) contacts.push_back(over.contact(face.places[i], face.numbers[i]));
  }
  return !contacts.empty();
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
  const Vec3 centre = to_shell.apply(ball.centre);
  const float reach = kStretch * ball.radius + distance;
  const auto over = [&](const HalfSpaceField& plane) {
    const Vec3 down = -1.0F * to_shell.rotate_back(plane.outward_normal);
    return Over{pair, plane, to_shell, outermost_of(partner, down), down};
  };
  constexpr float kNear_vx = 0.2F;  // of the plane and the samples
  const HalfSpaceField* plane = flat_around(map, centre, reach, false, memory.ground);
  if (plane == nullptr && memory.lay_flat() && pair.shell_motion != nullptr) {
    const HalfSpaceField* const tops = tops_around(map, centre, reach, memory.ground);
    const bool moves_on =
        tops != nullptr && moves_along(*pair.field_motion, *pair.shell_motion,
                                       Transform(pair.shell_pose).rotate(tops->outward_normal), map.voxel_size);
    if (moves_on && add_standing(over(*tops), memory.tops, contacts)) return (kIntoTops_vx + kNear_vx) * map.voxel_size;
  }
  constexpr float kSlow_vx = 6;
  if (plane == nullptr && distance < kSlow_vx * map.voxel_size) {
    plane = flat_around(map, centre, reach, true, memory.ground);
  }
  if (plane == nullptr) return {};
  const Over ground = over(*plane);
  float most = -distance;
  for (std::size_t i = 0; i < ground.outermost.count; ++i) {
    const Contact contact = ground.contact(ground.outermost.places[i], i);
    most = std::max(most, contact.penetration + kNear_vx * map.voxel_size);
    if (contact.penetration >= -distance) contacts.push_back(contact);
  }
  return most;
}

}  // namespace vps::detail

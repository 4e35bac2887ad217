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

// The deepest place of a solid in a half space is within `thickness` of one of its outermost places.
class Outermost {
 public:
  // @param down  into the ground, solid's frame, unit
  Outermost(const Partner& partner, Vec3 down) : places_(partner.hull.places), thickness_(partner.hull.margin) {
    if (places_.empty()) add_round(partner, down);
  }
  Outermost(const Outermost&) = delete;
  Outermost& operator=(const Outermost&) = delete;

  // Solid's frame. [m]
  [[nodiscard]] std::span<const Vec3> places() const { return places_; }
  [[nodiscard]] float thickness() const { return thickness_; }

 private:
  void add_round(const Partner& partner, Vec3 down) {
    partner.field.visit([&](const auto& field) {
      using Kind = std::remove_cvref_t<decltype(field)>;
      if constexpr (std::is_same_v<Kind, SphereField>) {
        thickness_ = field.radius;
        add({});
      }
      if constexpr (std::is_same_v<Kind, RevolvedField>) {
        using Profile = RevolvedField::Profile;
        const Vec3 top{0, 0, field.half_height};
        thickness_ = field.rounding;
        if (field.profile == Profile::capsule) {
          thickness_ += field.radius;
          add(-1.0F * top);
        } else {
          add_rim(field.radius, -field.half_height, down);
        }
        if (field.profile == Profile::cylinder) {
          add_rim(field.radius, field.half_height, down);
        } else {
          add(top);
        }
      }
    });
    places_ = {round_.data(), count_};
  }
  // Four places of a rim, of which the first is the deepest.
  void add_rim(float radius, float height, Vec3 down) {
    const float across = std::hypot(down.x, down.y);
    constexpr float kUpright = 1e-3F;  // the deepest place of a level rim is any
    const Vec3 u = across > kUpright ? (radius / across) * Vec3{down.x, down.y, 0} : Vec3{radius, 0, 0};
    add({u.x, u.y, height});
    add({-u.y, u.x, height});
    add({-u.x, -u.y, height});
    add({u.y, -u.x, height});
  }
  void add(Vec3 place) { round_[count_++] = place; }

  std::span<const Vec3> places_;
  float thickness_ = 0;
  std::array<Vec3, 8> round_;  // of a body without corners: two rims at most
  std::size_t count_ = 0;
};

// A ball that holds a solid, solid's frame. [m]
struct Ball {
  Vec3 centre;
  float radius = 0;  // 0: the solid is another
};
Ball ball_around(const Partner& partner) {
  Ball ball;
  const std::span<const Vec3> corners = partner.hull.places;
  if (!corners.empty()) {
    Vec3 low = corners[0];
    Vec3 high = corners[0];
    for (const Vec3 corner : corners) {
      low = {std::min(low.x, corner.x), std::min(low.y, corner.y), std::min(low.z, corner.z)};
      high = {std::max(high.x, corner.x), std::max(high.y, corner.y), std::max(high.z, corner.z)};
    }
    return {0.5F * (low + high), 0.5F * length(high - low) + partner.hull.margin};
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

// Whether a solid may stand.
bool may_stand(const Partner& partner) {
  if (!partner.hull.places.empty()) return partner.hull.places.size() <= kMostCorners;
  return partner.field.visit([](const auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, RevolvedField>) {
      return field.profile != RevolvedField::Profile::capsule;
    }
    return false;
  });
}

// A solid over a plane.
struct Over {
  const StepPair& pair;
  const HalfSpaceField& plane;  // map's frame
  const Transform& to_map;      // takes the solid's frame there
  Outermost outermost;
  Vec3 down;  // into the ground, solid's frame, unit

  [[nodiscard]] float depth(Vec3 place) const { return value_at(plane, to_map.apply(place)) + outermost.thickness(); }
  // @param number  of the place, of all that the solid may have
  [[nodiscard]] Contact contact(Vec3 place, std::size_t number) const {
    Contact contact;
    contact.penetration = depth(place);
    contact.inward_normal = down;
    contact.position = place - (contact.penetration - outermost.thickness()) * down;
    contact.point = pair.shell.points + static_cast<std::uint32_t>(number);
    return contact;
  }
};

constexpr float kIntoTops_vx = 0.5F;  // in the plane over tops a solid that stands on them is no deeper

// Whether a hull of many corners rolls without slip. They are facets of something round then, and on a plane they brake
// it.
bool rolls_on_facets(const Over& over, const Partner& partner, Vec3 centre) {
  const StepPair& pair = over.pair;
  if (partner.hull.places.size() <= kMostCorners || pair.field_motion == nullptr) return false;
  constexpr float kTurns = 2e-3F;  // [rad]
  constexpr float kSlip = 0.5F;    // of what it turns
  const StepMotion& motion = *pair.field_motion;
  if (!(length(motion.turn) > kTurns)) return false;
  const Vec3 up = -1.0F * Transform(pair.field_pose).rotate(over.down);
  const Vec3 height = (value_at(over.plane, over.to_map.apply(centre))) * up;
  const Vec3 turned = cross(motion.turn, height);  // how far the lowest place turns about the centre
  const Vec3 slip = motion.way - pair.shell_motion->way + turned;
  return length(slip - dot(up, slip) * up) < kSlip * length(turned);
}

// The corners of the face with which a solid stands on a plane, bits; 0: it is deep in it, or has no face there.
std::uint32_t face_on(const Over& over) {
  const float margin = over.pair.margin;
  std::uint32_t face = 0;
  for (std::size_t i = 0; i < over.outermost.places().size(); ++i) {
    const float depth = over.depth(over.outermost.places()[i]) + margin;
    if (depth > kIntoTops_vx * over.pair.distances.voxel_size) return 0;
    if (depth >= -over.pair.touching()) face |= 1U << i;
  }
  return std::popcount(face) >= 3 ? face : 0;
}

// Finds the places of a face that have ground below them: corners, places on the lines between these, and where the
// ground ends there. None where the solid does not stand on it, but in a hole or on an edge.
class FindGround {
 public:
  FindGround(const Over& over, std::uint32_t face, std::vector<PlaceOnTops>& places)
      : o_(over), places_(places), footing_(over.pair, over.pair.distances, over.plane) {
    places.clear();
    std::array<std::uint32_t, kMostCorners> corners{};
    std::size_t count = 0;
    for (std::uint32_t i = 0; i < o_.outermost.places().size(); ++i) {
      if ((face >> i & 1) != 0) corners[count++] = i;
    }
    for (std::size_t i = 0; i < count; ++i) grounded_[i] = sample(o_.outermost.places()[corners[i]], corners[i]);
    // Unequal ones do not all meet the slots of a grating. Hulls of many corners need fewer.
    static constexpr float kParts[] = {0.17F, 0.39F, 0.61F, 0.86F};
    const std::span<const float> all(kParts);
    const std::span<const float> parts = count <= 5 ? all : count <= 8 ? all.subspan(1, 2) : all.subspan(1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < i; ++k) {
        const Line line{o_.outermost.places()[corners[k]], o_.outermost.places()[corners[i]],
                        kMostCorners + kOfLine * (kMostCorners * corners[i] + corners[k])};
        sample_line(line, parts, grounded_[k], grounded_[i]);
      }
    }
    if (!footing_.holds() || places.size() < 3) places.clear();
  }

 private:
  struct Line {
    Vec3 from, to;
    std::uint32_t number;
    [[nodiscard]] Vec3 at(float part) const { return from + part * (to - from); }
  };
  static constexpr std::uint32_t kOfLine = 16;  // places, at most

  bool sample(Vec3 place, std::uint32_t number) {
    const Vec3 at = o_.to_map.apply(place);
    if (!footing_.test(at, at - o_.outermost.thickness() * o_.plane.outward_normal)) return false;
    places_.push_back({place, number});
    return true;
  }
  void sample_line(const Line& line, std::span<const float> parts, bool from_grounded, bool to_grounded) {
    float last = 0;
    bool was_grounded = from_grounded;
    std::uint32_t number = line.number;
    // A body tips about the end of the ground.
    const auto go_to = [&](float part, bool grounded) {
      if (grounded != was_grounded && ends_ < kMostEnds)
        add_end(line, grounded ? part : last, grounded ? last : part, number);
      last = part;
      was_grounded = grounded;
      number += 2;
    };
    for (const float part : parts) go_to(part, sample(line.at(part), number + 1));
    go_to(1, to_grounded);
  }
  // @param on, off  parts of the line, with and without ground
  void add_end(const Line& line, float on, float off, std::uint32_t number) {
    constexpr int kHalvings = 4;
    ++ends_;
    for (int n = 0; n < kHalvings; ++n) {
      const float middle = (on + off) / 2;
      (has_ground(o_.pair.distances, o_.plane, o_.to_map.apply(line.at(middle))) ? on : off) = middle;
    }
    places_.push_back({line.at(on), number});
  }

  static constexpr std::size_t kMostEnds = 24;

  const Over& o_;
  std::vector<PlaceOnTops>& places_;
  Footing footing_;
  std::array<bool, kMostCorners> grounded_{};
  std::size_t ends_ = 0;
};

// @return whether the solid stands on the plane over tops
bool add_standing(const Over& over, float distance, TopsMemory& memory, std::vector<Contact>& contacts) {
  const std::uint32_t face = face_on(over);
  if (face == 0) return false;
  if (memory.face != face || !stands_still(over.pair, memory.stand)) {
    memory.stand = over.pair.shell_to_field;
    memory.face = face;
    FindGround(over, face, memory.places);
  }
  for (const PlaceOnTops& place : memory.places) contacts.push_back(over.contact(place.at, place.number));
  if (memory.places.empty()) return false;
  for (std::uint32_t i = 0; i < over.outermost.places().size(); ++i) {
    if ((face >> i & 1) != 0) continue;
    const Contact contact = over.contact(over.outermost.places()[i], i);
    if (contact.penetration >= -distance) contacts.push_back(contact);
  }
  return true;
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
    return Over{pair, plane, to_shell, {partner, down}, down};
  };
  constexpr float kNear_vx = 0.2F;  // of the plane and the samples
  const HalfSpaceField* plane = flat_around(map, centre, reach, false, memory.ground);
  if (plane == nullptr && may_stand(partner) && memory.lay_flat() && pair.shell_motion != nullptr) {
    const HalfSpaceField* const tops = tops_around(map, centre, reach, memory.ground);
    const bool moves_on =
        tops != nullptr && moves_along(*pair.field_motion, *pair.shell_motion,
                                       Transform(pair.shell_pose).rotate(tops->outward_normal), map.voxel_size);
    if (moves_on && add_standing(over(*tops), distance, memory.tops, contacts))
      return (kIntoTops_vx + kNear_vx) * map.voxel_size;
  }
  constexpr float kSlow_vx = 6;
  if (plane == nullptr && distance < kSlow_vx * map.voxel_size) {
    plane = flat_around(map, centre, reach, true, memory.ground);
  }
  if (plane == nullptr) return {};
  const Over ground = over(*plane);
  if (rolls_on_facets(ground, partner, ball.centre)) return {};
  float most = -distance;
  for (std::size_t i = 0; i < ground.outermost.places().size(); ++i) {
    const Contact contact = ground.contact(ground.outermost.places()[i], i);
    most = std::max(most, contact.penetration + kNear_vx * map.voxel_size);
    if (contact.penetration >= -distance) contacts.push_back(contact);
  }
  return most;
}

}  // namespace vps::detail

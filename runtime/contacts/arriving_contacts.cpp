// SPDX-License-Identifier: Zlib
// Follows points along the motion of the step, to where they meet the partner.
#include "runtime/contacts/arriving_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <type_traits>

#include "runtime/contacts/refine_contact.h"
#include "runtime/contacts/round_contacts.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"
#include "runtime/fields/placed_field.h"

namespace vps::detail {
namespace {

// A body that rests may fall for so many steps.
constexpr float kStepsFromRest = 5;

// Bodies move together if one of them is faster than both approach each other, by this factor.
constexpr float kMoveTogether = 1.2F;
// They roll on each other only if they turn by so much in a step.
constexpr float kTurned_vx = 0.3F;

// The motion of a body, seen from the frame of contacts.
struct Course {
  RelativeMotion motion;
  Vec3 centre;

  Course(const StepMotion& of_body, const Pose& frame) noexcept {
    const double* const r = frame.rotation;
    double arm[3];
    for (int i = 0; i < 3; ++i) arm[i] = of_body.centre[i] - frame.translation[i];
    const auto turned_back = [r](const double(&v)[3]) {
      float out[3];
      for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(r[i] * v[0] + r[3 + i] * v[1] + r[6 + i] * v[2]);
      return Vec3{out[0], out[1], out[2]};
    };
    const Vec3 w = of_body.way;
    const Vec3 t = of_body.turn;
    centre = turned_back(arm);
    motion.turn = turned_back({t.x, t.y, t.z});
    motion.shift = turned_back({w.x, w.y, w.z}) - cross(motion.turn, centre);
  }
  [[nodiscard]] float turned_at(Vec3 place) const noexcept { return length(cross(motion.turn, place - centre)); }
};
RelativeMotion difference(const RelativeMotion& a, const RelativeMotion& b) noexcept {
  return {a.shift - b.shift, a.turn - b.turn};
}
const Pose& frame_of(const StepPair& pair, const FoundContacts& found) noexcept {
  return found.in_shell_frame ? pair.shell_pose : pair.field_pose;
}

// No farther from the surface than the point is: a step must not miss it.
float least_penetration(const VoxelmapView& map, Vec3 p) noexcept {
  return own_penetration(map, p, {}).v;
}
template <class Field>
float least_penetration(const Field& field, Vec3 p) noexcept {
  return value_at(field, p);
}

constexpr int kMostSteps = 256;

// Gives a contact the direction and the gap of the place where its point arrives.
// @return whether the surfaces face each other there
template <class Field>
bool arrives_at(const Field& field, Contact& contact, Vec3 place, float gap) {
  const Vec3 normal = vps::outward_normal(field, place);
  if (!(dot(normal, normal) > 0)) return true;
  if (dot(normal, contact.inward_normal) < kGrazing) return false;
  contact.inward_normal = normal;
  contact.penetration = -std::max(0.0F, dot(normal, contact.position - place) + gap);
  return true;
}

// Follows a point in steps as long as its distance from the field (sphere tracing; Hart 1996).
// @param way     motion of the point in the step, contacts' frame. [m]
// @param margin  thickness by the bodies' margins that the field does not include. [m]
// @param near    distance from the surface at which it has arrived. [m]
// @return whether it arrives where the surfaces face each other; false also for points that take too many steps: they
// graze
template <class Field>
bool arrives(const Field& field, Contact& contact, Vec3 way, float margin, float near) {
  const float size = length(way);
  float t = 0;
  for (int i = 0; i < kMostSteps && t < 1; ++i) {
    const Vec3 p = contact.position + t * way;
    const float gap = -least_penetration(field, p) - margin;
    if (gap <= near) return arrives_at(field, contact, p, gap);
    t += gap / size;
  }
  return false;
}

// The same for many contacts with a map, side by side: points that graze take a step for each tenth of a voxel.
// @param contacts  as many as Places has room for, or fewer
// @param arrived   set where one arrives; those that are set already are left alone
void arrive_together(const VoxelmapView& map, const PlacedField& placed, std::span<Contact> contacts,
                     const RelativeMotion& motion, float margin, float near, std::span<bool> arrived) {
  struct Traveller {
    std::uint32_t number;
    Vec3 way;
    float size, done;  // length of the way, and the part of it that is done
  };
  std::array<Traveller, Places::kMost> travellers;
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < contacts.size(); ++i) {
    const Vec3 way = way_at(motion, contacts[i].position);
    if (!arrived[i]) travellers[count++] = {i, way, length(way), 0};
  }
  Places places;
  Values v;
  for (int step = 0; step < kMostSteps && count > 0; ++step) {
    places.count = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      places.push(contacts[travellers[k].number].position + travellers[k].done * travellers[k].way);
    }
    placed.penetrations(places, v);
    std::uint32_t left = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      Traveller one = travellers[k];
      const float gap = -v[k] - margin;
      if (gap <= near) {
        arrived[one.number] = arrives_at(map, contacts[one.number], places[k], gap);
        continue;
      }
      one.done += gap / one.size;
      if (one.done < 1) travellers[left++] = one;
    }
    count = left;
  }
}

// Follows a place of the partner, the centre of a round end or a corner, into the shell's distance field.
// @param motion  of the shell, relative to the partner
bool arrives_on_map(const StepPair& pair, const Partner& partner, const FoundContacts& found, const Contact& contact,
                    float near, const RelativeMotion& motion) {
  const std::optional<Round> round = round_of(partner.field);
  const float thickness = round ? round->radius : 0;
  const Vec3 centre = contact.position + (contact.penetration - pair.margin - thickness) * contact.inward_normal;
  const Transform to_shell = found.in_shell_frame ? Transform(Pose()) : pair.to_shell();
  Contact moving = contact;
  moving.position = to_shell.apply(centre);
  moving.inward_normal = -1.0F * to_shell.rotate(contact.inward_normal);
  return arrives(pair.distances, moving, -1.0F * to_shell.rotate(way_at(motion, centre)), thickness + pair.margin,
                 near);
}

// The inward normal of the partner's surface, up to its sign. A contact that touches already has the normal of the
// shell's point, which at an edge lies between those of two faces.
Vec3 normal_of(const Partner& partner, const FoundContacts& found, const Contact& contact, bool arrives) {
  if (partner.sheet != nullptr || found.is_on_map(contact) || (arrives && found.is_ahead(contact))) {
    return contact.inward_normal;
  }
  const Vec3 normal =
      partner.field.visit([&](const auto& field) { return vps::outward_normal(field, contact.position); });
  return dot(normal, normal) > 0 ? normal : contact.inward_normal;
}

// The deepest place, also if it does not arrive: that of a wheel that hops moves up.
std::optional<Contact> deepest_of(std::span<const Contact> contacts) {
  const auto is_shallower = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
  const auto deepest = std::max_element(contacts.begin(), contacts.end(), is_shallower);
  return deepest != contacts.end() ? std::optional(*deepest) : std::nullopt;
}

// One of the bodies rolls if it turns about the deepest contact faster than it falls onto it, and does not fall far.
// Its other contacts ahead then lie on surfaces that roll past. A body deep in the other one does not roll: all
// contacts push it out.
Rolling rolling(const StepPair& pair, const Partner& of_partner, const Course& shell, const Course& partner,
                const FoundContacts& found, const std::optional<Contact>& before) {
  constexpr float kDeep_vx = 2;
  constexpr float kHop_vx = 5;     // a wheel comes down from its hops
  constexpr float kBeside_vx = 4;  // a contact slides as far
  const auto voxel = static_cast<float>(pair.voxel_size);
  if (found.contacts.empty()) return {};
  const auto kept = std::find_if(found.contacts.begin(), found.contacts.end(),
                                 [&](const Contact& contact) { return contact.point == before->point; });
  const Contact* const deepest = kept != found.contacts.end() ? &*kept : &*before;
  const Rolling none{0, {}, {}};
  if (deepest->penetration > kDeep_vx * voxel) return none;
  const Vec3 place = deepest->position;
  const RelativeMotion motion = difference(shell.motion, partner.motion);
  const Vec3 normal = normal_of(of_partner, found, *deepest, kept != found.contacts.end());
  const auto fall_at = [&](Vec3 at) { return std::abs(dot(normal, way_at(motion, at))); };
  const float fall = fall_at(place);
  const Course& roller = shell.turned_at(place) >= partner.turned_at(place) ? shell : partner;
  const float turned = roller.turned_at(place);
  const float from_rest = kStepsFromRest * length(pair.shell_motion->fall - pair.field_motion->fall);
  if (found.is_joint && turned < kTurned_vx * voxel) return none;
  // A body that spins as it lands may have a contact that hardly falls, but its centre does.
  const float farthest = std::max(fall, fall_at(roller.centre));
  if (!(turned > fall && farthest < kHop_vx * voxel + from_rest)) return none;
  // A round body's points that arrive as it turns by `angle` and falls by `farthest`: h^2 / 2 = angle h + farthest / r.
  const float angle = length(roller.motion.turn);
  const float radius = turned / angle;
  const float reach = radius * (angle + std::sqrt(angle * angle + 2 * farthest / radius));
  return {reach + kBeside_vx * voxel, place, (1 / angle) * cross(roller.motion.turn, normal)};
}

template <class Is>
void remove_contacts(FoundContacts& found, const Is& is) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.contacts.size(); ++i) {
    if (is(found.contacts[i])) continue;
    if (!found.features.empty()) found.features[kept] = found.features[i];
    found.contacts[kept++] = found.contacts[i];
  }
  found.contacts = found.contacts.first(kept);
}

constexpr float kFacet_vx = 0.5F;  // how far the surface of a round body is off its circles

// The way of a place about the centre of its body.
struct Circle {
  Vec3 axis, centre, arm;
};
Circle circle_of(const Course& body, Vec3 place) {
  const Vec3 axis = (1 / length(body.motion.turn)) * body.motion.turn;
  const Vec3 centre = body.centre + dot(axis, place - body.centre) * axis;
  return {axis, centre, place - centre};
}

// The lowest place of a contact's circle. Nothing where the body does not roll, but spins on a face.
// @param normal  of the partner there, into the body
std::optional<Contact> lowest_of(const Course& roller, Contact contact, Vec3 normal) {
  const Circle circle = circle_of(roller, contact.position);
  const Vec3 up = normal - dot(circle.axis, normal) * circle.axis;
  constexpr float kLevel = 0.7F;  // cosine of the axis against the face
  if (!(length(up) > kLevel)) return {};
  const Vec3 place = circle.centre - (length(circle.arm) / length(up)) * up;
  contact.penetration += dot(normal, contact.position - place);
  contact.position = place;
  return contact;
}

// Whether the shell's body has its surface along the circle of a place, from there to what comes there in the step.
bool is_round_about_axis(const StepPair& pair, const Transform& to_shell, const Course& shell, Vec3 place) {
  constexpr float kFarthest = 1;  // farther round it is not asked. [rad]
  const Circle circle = circle_of(shell, place);
  const Vec3 across = cross(circle.axis, circle.arm);
  for (const float part : {0.0F, 0.5F, 1.0F}) {
    const float angle = part * std::min(length(shell.motion.turn), kFarthest);
    const Vec3 comes = circle.centre + std::cos(angle) * circle.arm - std::sin(angle) * across;
    const float v = vps::penetration(pair.distances, to_shell.apply(comes), {});
    if (!(std::abs(v) <= kFacet_vx * pair.distances.voxel_size)) return false;
  }
  return true;
}

// On a straight line, points of the flank of a body that turns far go deep into the partner, and the solver, which
// stops them, throws the body up. Where the body is round, a place of the flank comes no deeper than the deepest one:
// it meets the partner with the lowest place of its circle, which falls as the centre does.
// @param shell  relative to the partner
void meet_with_circles(const StepPair& pair, const Partner& partner, const Course& shell, const Contact& deepest,
                       FoundContacts& found) {
  if (pair.distances.field == Field::none) return;
  const Transform to_shell = found.in_shell_frame ? Transform(Pose()) : pair.to_shell();
  const float facet = kFacet_vx * static_cast<float>(pair.voxel_size);
  // At an edge the partner is not there. Triangles are not asked.
  const auto is_met = [&](const Contact& lowest) {
    if (partner.sheet != nullptr) return lowest.penetration <= deepest.penetration + facet;
    const float v =
        partner.field.visit([&](const auto& field) { return vps::penetration(field, lowest.position, {}); });
    return std::abs(v + pair.margin - lowest.penetration) <= facet;
  };
  const std::optional<Contact> of_deepest = lowest_of(shell, deepest, normal_of(partner, found, deepest, false));
  if (!of_deepest || !is_met(*of_deepest) || !is_round_about_axis(pair, to_shell, shell, of_deepest->position)) return;
  const float most = of_deepest->penetration + facet;
  const Vec3 way = way_at(shell.motion, shell.centre);
  remove_contacts(found, [&](Contact& contact) {
    if (found.is_on_map(contact)) return false;
    const Vec3 normal = normal_of(partner, found, contact, true);
    const std::optional<Contact> lowest = lowest_of(shell, contact, normal);
    if (!lowest || lowest->penetration > most || !is_met(*lowest)) return false;
    contact = *lowest;
    return contact.penetration + std::max(0.0F, -dot(normal, way)) < -pair.touching();
  });
}

// Where the deepest place is below the centre of the body that falls, the fall ends there, and no other place is
// reached unless the body turns. In the few iterations of a solver these would carry a part of it, and brake or turn
// the body.
// @param shell   relative to the partner
// @param centre  of the body that falls
void keep_carrying(const StepPair& pair, const Partner& partner, const Course& shell, Vec3 centre,
                   const Contact& deepest, FoundContacts& found) {
  constexpr float kBelow = 0.1F;      // sine of the place's angle off the normal
  constexpr float kBeside_vx = 0.2F;  // places of a face differ by less
  const Vec3 arm = deepest.position - centre;
  if (!(length(cross(arm, normal_of(partner, found, deepest, false))) < kBelow * length(arm))) return;
  const Transform to_shell = found.in_shell_frame ? Transform(Pose()) : pair.to_shell();
  const bool is_round = found.turn > 0 && pair.distances.field != Field::none &&
                        is_round_about_axis(pair, to_shell, shell, deepest.position);
  const float turn = is_round ? 0 : found.turn;
  const float least = deepest.penetration - kBeside_vx * static_cast<float>(pair.voxel_size);
  remove_contacts(found, [&](const Contact& contact) {
    return contact.penetration < least - turn * length(contact.position - deepest.position);
  });
}

}  // namespace

Approach fast_approach(const StepMotion& first, const StepMotion& second, double voxel_size) noexcept {
  const auto swing = [](const StepMotion& body) {
    const float turn = length(body.turn);
    return turn > 0 ? turn * body.radius : 0;
  };
  const float spin = swing(first) + swing(second);
  const float between = length(first.way - second.way);
  const float way = between + spin;
  constexpr float kFarthest = 1e6F;  // a body that moves farther in a step has left its world. [m]
  if (!(way < kFarthest)) return {};
  const auto voxel = static_cast<float>(voxel_size);
  if (first.yields && second.yields) {
    const float fastest = std::max(length(first.way), length(second.way));
    const float fall = std::max(length(first.fall), length(second.fall));
    const float alone = std::min(fastest + spin, kStepsFromRest * fall);
    if (fastest > kMoveTogether * between && alone > voxel && alone < kFarthest) {
      const bool is_still = way <= voxel && fall <= kLongFall_vx * voxel;
      return {std::max(way, alone), true, is_still ? Approach::Phase::still : Approach::Phase::resting};
    }
  }
  if (!(way > voxel)) return {};
  const float fall = length(first.fall - second.fall);
  if (way > voxel + kStepsFromRest * fall) return {way, false, Approach::Phase::landing};
  const bool is_still = way <= voxel + fall && fall <= kLongFall_vx * voxel;
  return {way, false, is_still ? Approach::Phase::still : Approach::Phase::resting};
}

RelativeMotion motion_of(const StepPair& pair, const FoundContacts& found) noexcept {
  const Pose& frame = frame_of(pair, found);
  return difference(Course(*pair.shell_motion, frame).motion, Course(*pair.field_motion, frame).motion);
}

void keep_arriving(const StepPair& pair, const Partner& partner, FoundContacts& found) {
  const Pose& frame = frame_of(pair, found);
  const Course of_shell(*pair.shell_motion, frame);
  const Course of_partner(*pair.field_motion, frame);
  found.motion = difference(of_shell.motion, of_partner.motion);
  found.turn = length(found.motion.turn);
  const RelativeMotion if_shell_stops = difference({}, of_partner.motion);
  const std::optional<Contact> deepest = deepest_of(found.contacts);
  const float near = pair.touching();
  const auto keep_on_map = [&](const VoxelmapView& map) {
    const PlacedField placed(map, Pose());
    std::size_t kept = 0;
    for (std::size_t from = 0; from < found.contacts.size(); from += Places::kMost) {
      const std::span<Contact> some =
          found.contacts.subspan(from, std::min(Places::kMost, found.contacts.size() - from));
      std::array<bool, Places::kMost> arrived;
      for (std::size_t i = 0; i < some.size(); ++i) arrived[i] = some[i].penetration >= -near;
      const auto follow = [&](const RelativeMotion& motion) {
        arrive_together(map, placed, some, motion, pair.margin, near, arrived);
      };
      follow(found.motion);
      if (found.is_joint) {
        follow(of_shell.motion);
        follow(if_shell_stops);
      }
      for (std::size_t i = 0; i < some.size(); ++i) {
        if (arrived[i]) found.contacts[kept++] = some[i];
      }
    }
    found.contacts = found.contacts.first(kept);
  };
  const auto keep = [&](const auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, VoxelmapView>) {
      if (field.field != Field::layers && !found.has_map_contacts) return keep_on_map(field);
    }
    const auto arrives_by = [&](const RelativeMotion& motion, Contact& contact) {
      if (found.is_on_map(contact)) return arrives_on_map(pair, partner, found, contact, near, motion);
      return arrives(field, contact, way_at(motion, contact.position), pair.margin, near);
    };
    const auto is_none = [&](Contact& contact) {
      if (contact.penetration >= -near || arrives_by(found.motion, contact)) return false;
      return !found.is_joint || !(arrives_by(of_shell.motion, contact) || arrives_by(if_shell_stops, contact));
    };
    const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_none);
    found.contacts = {found.contacts.begin(), last};
  };
  if (found.refined == FoundContacts::Refined::none) {
    found.refined = FoundContacts::Refined::arriving;
  }
  found.arriving_beyond = near;
  if (partner.sheet == nullptr) {
    partner.field.visit(keep);
  }
  constexpr float kTurnsFar = 0.15F;  // [rad]
  Course relative = of_shell;
  relative.motion = found.motion;
  if (deepest && !found.is_joint && std::min(found.turn, length(of_shell.motion.turn)) > kTurnsFar) {
    meet_with_circles(pair, partner, relative, *deepest, found);
  }
  if (deepest && !found.is_joint && !pair.has_springs() && pair.segment_level == 0) {
    const Vec3 centre = pair.shell_motion->yields ? of_shell.centre : of_partner.centre;
    keep_carrying(pair, partner, relative, centre, *deepest, found);
  }
  // Corners that do not arrive must not cost a landing body its segments.
  found.has_map_contacts = std::any_of(found.contacts.begin(), found.contacts.end(),
                                       [&](const Contact& contact) { return found.is_on_map(contact); });
  found.rolling = rolling(pair, partner, of_shell, of_partner, found, deepest);
}

}  // namespace vps::detail

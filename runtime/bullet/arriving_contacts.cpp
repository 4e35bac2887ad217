// SPDX-License-Identifier: Zlib
// Follows points along the motion of the step, to where they meet the partner.
#include "runtime/bullet/arriving_contacts.h"

#include <algorithm>

#include "runtime/bullet/body_motion.h"
#include "runtime/bullet/partners/partner_field.h"
#include "runtime/contacts/refine_contact.h"
#include "runtime/fields/penetration.h"

namespace vps::bullet {
namespace {

using detail::operator+;
using detail::operator-;
using detail::operator*;

// A body that rests may fall for so many steps.
constexpr btScalar kStepsFromRest = 5;

// Bodies move together if one of them is faster than both approach each other, by this factor.
constexpr btScalar kTogether = btScalar(1.2);
// They roll on each other only if they turn by so much in a step.
constexpr btScalar kTurned_vx = btScalar(0.3);

// Velocity of a body in the step, the effect of its forces included.
struct Course {
  btVector3 linear{0, 0, 0}, angular{0, 0, 0}, centre{0, 0, 0};
  btVector3 gain{0, 0, 0};  // of `linear`, by the forces of the step

  Course(const PairBody& side, btScalar step) {
    const Velocity velocity = velocity_of(*side.object);
    gain = step * acceleration_of(*side.object);
    linear = velocity.linear + gain;
    angular = velocity.angular;
    centre = side.object->getWorldTransform().getOrigin();
  }
  [[nodiscard]] btVector3 at(const btVector3& place) const { return linear + angular.cross(place - centre); }
};

// A voxelmap with the functions of an analytic field.
struct MapField {
  const VoxelmapView& map;
};
// No farther from the surface than the point is: a step must not miss it.
float penetration(const MapField& field, Vec3 p) {
  return detail::own_penetration(field.map, p, {}).v;
}
Vec3 outward_normal(const MapField& field, Vec3 p) {
  return vps::outward_normal(field.map, p);
}

// Follows a point in steps as long as its distance from the field (sphere tracing; Hart 1996).
// @param way     motion of the point in the step, contacts' frame. [m]
// @param margin  thickness by the bodies' margins that the field does not include. [m]
// @param near    distance from the surface at which it has arrived. [m]
// @return whether it arrives where the surfaces face each other; false also for points that take too many steps: they
// graze
template <class Field>
bool arrives(const Field& field, Contact& contact, Vec3 way, float margin, float near) {
  constexpr int kSteps = 256;
  const float length = detail::length(way);
  float t = 0;
  for (int i = 0; i < kSteps && t < 1; ++i) {
    const Vec3 p = contact.position + t * way;
    using vps::outward_normal;
    using vps::penetration;
    const float gap = -penetration(field, p) - margin;
    if (gap <= near) {
      const Vec3 normal = outward_normal(field, p);
      if (!(detail::dot(normal, normal) > 0)) return true;
      if (detail::dot(normal, contact.inward_normal) < detail::kGrazing) return false;
      contact.inward_normal = normal;
      contact.penetration = -std::max(0.0F, detail::dot(normal, contact.position - p) + gap);
      return true;
    }
    t += gap / length;
  }
  return false;
}

// Follows a place of the partner, the centre of a round end or a corner, into the shell's distance field.
// @param step_way  motion of the shell at a place, relative to the partner
template <class Way>
bool arrives_on_map(const Pair& pair, const FoundContacts& found, const Contact& contact, float near,
                    const Way& step_way) {
  const btCollisionShape& shape = *pair.field.shape;
  btScalar radius = 0;
  if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) radius = static_cast<const btSphereShape&>(shape).getRadius();
  if (shape.getShapeType() == CAPSULE_SHAPE_PROXYTYPE) radius = static_cast<const btCapsuleShape&>(shape).getRadius();
  const auto thickness = static_cast<float>(radius);
  const Vec3 centre = contact.position + (contact.penetration - margin_of(pair) - thickness) * contact.inward_normal;
  const btVector3 place = found.frame * to_bt(centre);
  const btTransform to_asset = (pair.shell.world * pair.shell.asset_frame()).inverse();
  Contact moving = contact;
  moving.position = to_vec3(to_asset * place);
  moving.inward_normal = to_vec3(to_asset.getBasis() * found.frame.getBasis() * -to_bt(contact.inward_normal));
  return arrives(MapField{pair.shell.vps->distances()}, moving, to_vec3(to_asset.getBasis() * -step_way(place)),
                 thickness + static_cast<float>(pair.shell.vps->getMargin()), near);
}

// Whether one of the bodies rolls: it turns about the deepest contact faster than it falls onto it, and does not fall
// far. Its other contacts ahead then lie on surfaces that roll past. A body deep in the other one does not roll:
// all contacts push it out.
bool rolls(const Pair& pair, const Course& shell, const Course& partner, btScalar step, const FoundContacts& found) {
  constexpr btScalar kDeep_vx = 2;
  constexpr btScalar kHop_vx = 5;  // a wheel comes down from its hops
  const auto is_shallower = [](const Contact& a, const Contact& b) { return a.penetration < b.penetration; };
  const auto deepest = std::max_element(found.contacts.begin(), found.contacts.end(), is_shallower);
  if (deepest == found.contacts.end()) return true;
  if (deepest->penetration > kDeep_vx * voxel_size(pair)) return false;
  const btVector3 place = found.frame * to_bt(deepest->position);
  const btVector3 normal = found.frame.getBasis() * to_bt(deepest->inward_normal);
  const btScalar fall = step * std::abs(normal.dot(shell.at(place) - partner.at(place)));
  const auto turned_by = [&](const Course& body) { return step * body.angular.cross(place - body.centre).length(); };
  const btScalar turned = std::max(turned_by(shell), turned_by(partner));
  const btScalar from_rest = kStepsFromRest * step * (shell.gain - partner.gain).length();
  if (found.is_joint && turned < kTurned_vx * voxel_size(pair)) return false;
  return turned > fall && fall < kHop_vx * voxel_size(pair) + from_rest;
}

// Whether the solver may stop either body. Bodies of triangles have no test of what arrives.
bool both_may_be_stopped(const Pair& pair) {
  return inverse_mass(*pair.shell.object) > 0 && inverse_mass(*pair.field.object) > 0 &&
         !is_triangle_mesh(pair.field.shape->getShapeType());
}

}  // namespace

Approach approach(const Pair& pair, btScalar step) {
  if (pair.shell.object->getRestitution() * pair.field.object->getRestitution() > 0) return {};
  const Course shell(pair.shell, step);
  const Course field(pair.field, step);
  btScalar spin = 0;
  for (const PairBody* const side : {&pair.shell, &pair.field}) {
    btVector3 centre;
    btScalar radius = 0;
    const btScalar turn = (side == &pair.shell ? shell : field).angular.length();
    if (turn == 0) continue;
    side->object->getCollisionShape()->getBoundingSphere(centre, radius);
    spin += turn * (centre.length() + radius);
  }
  const btScalar between = (shell.linear - field.linear).length();
  const btScalar way = step * (between + spin);
  constexpr btScalar kFarthest = 1000;  // a body that moves farther in a step has left its world. [m]
  if (!(way < kFarthest)) return {};
  const btScalar voxel = voxel_size(pair);
  if (both_may_be_stopped(pair)) {
    const btScalar fastest = std::max(shell.linear.length(), field.linear.length());
    const btScalar fall = step * std::max(shell.gain.length(), field.gain.length());
    const btScalar alone = std::min(step * (fastest + spin), kStepsFromRest * fall);
    if (fastest > kTogether * between && alone > voxel && alone < kFarthest) {
      const bool is_still = way <= voxel && fall <= 2 * voxel;
      return {std::max(way, alone), true, is_still ? Approach::Phase::still : Approach::Phase::resting};
    }
  }
  if (!(way > voxel)) return {};
  const btScalar fall = step * (shell.gain - field.gain).length();
  if (way > voxel + kStepsFromRest * fall) return {way, false, Approach::Phase::landing};
  // Four contacts of a body that falls farther in a step may all lie on one side: it would tip through the ground.
  const bool is_still = way <= voxel + fall && fall <= 2 * voxel;
  return {way, false, is_still ? Approach::Phase::still : Approach::Phase::resting};
}

detail::RelativeMotion motion_in(const Pair& pair, btScalar step, const btTransform& frame) {
  const Course shell(pair.shell, step);
  const Course field(pair.field, step);
  const btVector3 turn = step * (shell.angular - field.angular);
  const btVector3 at_origin = step * (shell.at(frame.getOrigin()) - field.at(frame.getOrigin()));
  const btMatrix3x3 to_frame = frame.getBasis().transpose();
  return {to_vec3(to_frame * at_origin), to_vec3(to_frame * turn)};
}

void keep_arriving(const Pair& pair, btScalar step, PairMemory& memory, FoundContacts& found) {
  const Course shell(pair.shell, step);
  const Course partner(pair.field, step);
  const auto near = static_cast<float>(contact_distance(pair));
  // Motions of the shell in the step, relative to the partner.
  const auto of_both = [&](const btVector3& place) { return step * (shell.at(place) - partner.at(place)); };
  const auto of_shell = [&](const btVector3& place) { return step * shell.at(place); };
  const auto of_partner = [&](const btVector3& place) { return -step * partner.at(place); };
  const auto keep = [&](const auto& field, float margin) {
    const auto arrives_by = [&](const auto& step_way, Contact& contact) {
      if (found.is_on_map(contact)) return arrives_on_map(pair, found, contact, near, step_way);
      const btVector3 place = found.frame * to_bt(contact.position);
      return arrives(field, contact, to_vec3(found.frame.getBasis().transpose() * step_way(place)), margin, near);
    };
    const auto is_none = [&](Contact& contact) {
      if (contact.penetration >= -near || arrives_by(of_both, contact)) return false;
      return !found.is_joint || !(arrives_by(of_shell, contact) || arrives_by(of_partner, contact));
    };
    const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_none);
    found.contacts = {found.contacts.begin(), last};
    return Status::ok;
  };
  if (found.refined == FoundContacts::Refined::none) {
    found.refined = FoundContacts::Refined::arriving;
  }
  found.arriving_beyond = near;
  found.motion = motion_in(pair, step, found.frame);
  found.turn = static_cast<float>(step * (shell.angular - partner.angular).length());
  if (pair.field.vps != nullptr) {
    (void)keep(MapField{pair.field.vps->voxelmap()}, margin_of(pair));
  } else if (!is_triangle_mesh(pair.field.shape->getShapeType())) {
    // Fields of Bullet's own shapes include their margins.
    const auto margin = static_cast<float>(pair.shell.vps->getMargin());
    const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
    (void)on_partner(*pair.field.shape, from, memory.planes,
                     [&](const auto& field, const btTransform&) { return keep(field, margin); });
  }
  // Corners that do not arrive must not cost a landing body its segments.
  found.has_map_contacts = std::any_of(found.contacts.begin(), found.contacts.end(),
                                       [&](const Contact& contact) { return found.is_on_map(contact); });
  found.may_slide = rolls(pair, shell, partner, step, found);
}

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
// Describes Bullet's shapes as partners.
#include "runtime/bullet/partners/partner.h"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <limits>

#include "runtime/bullet/body_motion.h"
#include "runtime/bullet/partners/sheet_field.h"

namespace vps::bullet {
namespace {

float number(btScalar value) {
  return static_cast<float>(value);
}

// Rotation that takes z, the axis of solids of revolution, to another axis.
btTransform along_axis(int axis) {
  btMatrix3x3 basis(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (int i = 0; i < 3; ++i) basis[(axis + 1 + i) % 3][i] = 1;
  return btTransform(basis);
}

FieldRef ref_of(const OwnField& field) {
  return std::visit([](const auto& of) { return FieldRef(of); }, field);
}

// Boxes and cylinders have sharp edges and Bullet's full size; cones and hulls are rounded by their margins, as in
// Bullet.
// @param from  position of the shell, shape's frame. [m]
OwnField own_field(const btCollisionShape& shape, const btVector3& from, ConvexPlanes& planes) {
  switch (shape.getShapeType()) {
    case BOX_SHAPE_PROXYTYPE:
      return BoxField{to_vec3(static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin())};
    case SPHERE_SHAPE_PROXYTYPE:
      return SphereField{number(static_cast<const btSphereShape&>(shape).getRadius())};
    case STATIC_PLANE_PROXYTYPE: {
      const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
      return HalfSpaceField{to_vec3(plane.getPlaneNormal()), number(plane.getPlaneConstant())};
    }
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      return RevolvedField{RevolvedField::Profile::capsule, number(capsule.getRadius()),
                           number(capsule.getHalfHeight()), 0};
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      return RevolvedField{RevolvedField::Profile::cylinder, number(cylinder.getRadius()),
                           number(cylinder.getHalfExtentsWithMargin()[cylinder.getUpAxis()]), 0};
    }
    case CONE_SHAPE_PROXYTYPE: {
      const auto& cone = static_cast<const btConeShape&>(shape);
      return RevolvedField{RevolvedField::Profile::cone, number(cone.getRadius()), number(cone.getHeight() / 2),
                           number(cone.getMargin())};
    }
    default:
      return planes.of(static_cast<const btConvexShape&>(shape), from);
  }
}

// A solid that falls fast may meet the ground with any of a box's corners.
constexpr std::size_t kManifoldsAhead = 2;

// How a body moves in the step. The effect of the forces of the step is included.
StepMotion motion_in_step(const PairBody& body, btScalar step) {
  const btCollisionObject& object = *body.object;
  const Velocity velocity = velocity_of(object);
  const btVector3 gain = step * acceleration_of(object);
  btVector3 centre(0, 0, 0);
  btScalar radius = 0;
  if (!velocity.angular.isZero()) object.getCollisionShape()->getBoundingSphere(centre, radius);
  const btVector3& at = object.getWorldTransform().getOrigin();
  return {{double(at.x()), double(at.y()), double(at.z())},
          to_vec3(step * (velocity.linear + gain)),
          to_vec3(step * velocity.angular),
          to_vec3(step * gain),
          number(centre.length() + radius),
          // Bodies of triangles have no test of what arrives.
          inverse_mass(object) > 0 && !is_triangle_mesh(body.shape->getShapeType())};
}

// Contacts ahead take from a bounce. What Bullet lets bounce no more, slower than its threshold, or what gravity would
// bring back within the step, needs them to come to rest.
// @return the farthest way of a pair in the step with which it has them. [m]
float most_way(const PairBody& first, const PairBody& second, btScalar step, const StepMotion (&motions)[2]) {
  using detail::operator-;
  const float restitution = number(gCalculateCombinedRestitutionCallback(first.object, second.object));
  if (!(restitution > 0)) return std::numeric_limits<float>::infinity();
  constexpr float kThreshold = 0.2F;  // btContactSolverInfo::m_restitutionVelocityThreshold by default. [m/s]
  // A multibody's velocity has the gain of the step when Bullet looks at it.
  for (const PairBody* const body : {&first, &second}) {
    if (body->object->getInternalType() == btCollisionObject::CO_FEATHERSTONE_LINK) return kThreshold * number(step);
  }
  const float fall = detail::length(motions[0].fall - motions[1].fall);
  return std::max(kThreshold * number(step) + fall, fall / (2 * restitution));
}

}  // namespace

PairStep step_of(const PairBody& first, const PairBody& second, btScalar step, btScalar distance, LookAhead ahead) {
  const bool looks_ahead = ahead == LookAhead::yes;
  const auto motion_of = [&](const PairBody& body) { return looks_ahead ? motion_in_step(body, step) : StepMotion(); };
  PairStep out{{motion_of(first), motion_of(second)}, looks_ahead, {}, 0, 0};
  double voxel = std::numeric_limits<double>::max();
  float spacing = 0;
  for (const PairBody* const body : {&first, &second}) {
    if (body->vps == nullptr) continue;
    const double own = body->vps->info().voxel_size;
    // The finer body gives the points, of two that are about as fine either.
    if (own < 2 * voxel) {
      spacing = std::max(own < voxel / 2 ? 0 : spacing, detail::spacing_vx(body->vps->pointshell(), own));
    }
    voxel = std::min(voxel, own);
    out.margin += number(body->vps->getMargin());
  }
  if (looks_ahead) out.query.approach = detail::approach(out.motions[0], out.motions[1], voxel);
  if (out.query.approach.way > most_way(first, second, step, out.motions)) {
    out.looks_ahead = false;
    out.query.approach = {};
  }
  out.query.most_ahead = kManifoldsAhead * MANIFOLD_CACHE_SIZE;
  out.query.distance = std::max(detail::contact_distance(voxel, spacing), number(distance));
  out.reach = double{out.query.distance + out.query.approach.way};
  return out;
}

WayAhead way_ahead(const PairBody& first, const PairBody& second, btScalar step, LookAhead ahead) {
  using detail::operator-;
  if (ahead == LookAhead::no) return {};
  const StepMotion motions[] = {motion_in_step(first, step), motion_in_step(second, step)};
  const detail::Approach approach = detail::approach(motions[0], motions[1], 0);
  // Either of two bodies that move together may be stopped.
  if (approach.is_joint || !(approach.way > 0)) return {{0, 0, 0}, approach.way};
  const btVector3 way = to_bt(motions[1].way - motions[0].way);
  return {way, std::max(btScalar(approach.way) - way.length(), btScalar(0))};
}

detail::StepPair in_step(const Pair& pair, const PairStep* step) {
  const Shape& shell = *pair.shell.vps;
  const Shape* const field = pair.field.vps;
  const double voxel = shell.info().voxel_size;
  // Fields of Bullet's convex shapes include their margins.
  const bool is_thick = field != nullptr || is_triangle_mesh(pair.field.shape->getShapeType());
  const bool moves = step != nullptr && step->looks_ahead;
  return {shell.pointshell(),
          shell.distances(),
          to_pose(pair.shell.world, pair.shell.asset_frame()),
          to_pose(pair.field.world, field_frame(pair.field)),
          voxel,
          field != nullptr ? std::min(voxel, field->info().voxel_size) : voxel,
          number(shell.getMargin() + (is_thick ? pair.field.shape->getMargin() : 0)),
          foundation_of(pair).stiffness > 0 ? StepUse::springs : StepUse::constraints,
          shell.segment_level(),
          moves ? &step->motions[0] : nullptr,
          moves ? &step->motions[1] : nullptr};
}

detail::Workspace& workspace() {
  thread_local detail::Workspace space;
  return space;
}

btTransform field_frame(const PairBody& body) {
  if (body.vps != nullptr) return body.asset_frame();
  switch (body.shape->getShapeType()) {
    case CAPSULE_SHAPE_PROXYTYPE:
      return along_axis(static_cast<const btCapsuleShape*>(body.shape)->getUpAxis());
    case CYLINDER_SHAPE_PROXYTYPE:
      return along_axis(static_cast<const btCylinderShape*>(body.shape)->getUpAxis());
    case CONE_SHAPE_PROXYTYPE:
      return along_axis(static_cast<const btConeShape*>(body.shape)->getConeUpIndex());
    default:
      return btTransform::getIdentity();
  }
}

detail::FieldBox box_of(const PairBody& body) {
  btVector3 low;
  btVector3 high;
  body.shape->getAabb(field_frame(body).inverse(), low, high);
  return {to_vec3(low), to_vec3(high)};
}

float arm_of(const PairBody& body) {
  if (body.vps == nullptr) return std::numeric_limits<float>::infinity();
  btVector3 centre;
  btScalar radius = 0;
  body.vps->getBoundingSphere(centre, radius);
  // The field may lie a little outside the bounds of its mesh.
  return number(centre.length() + radius - body.vps->getMargin() + btScalar(body.vps->info().voxel_size));
}

std::optional<detail::Partner> PairPartner::of(const Pair& pair, bool has_way) {
  const btCollisionShape& shape = *pair.field.shape;
  const auto with_radius = [&](detail::Partner partner) {
    if (has_way) partner.radius = box_of(pair.field).radius();
    return partner;
  };
  if (pair.field.vps != nullptr) return with_radius({pair.field.vps->voxelmap()});
  if (is_triangle_mesh(shape.getShapeType())) {
    pair_ = &pair;
    return with_radius({ref_of(field_), nullptr, this});
  }
  if (!is_partner_field(shape.getShapeType())) return std::nullopt;
  field_ = own_field(shape, pair.field.world.invXform(pair.shell.world.getOrigin()), planes_);
  const bool is_polytope = std::holds_alternative<PolytopeField>(field_);
  detail::Partner partner = with_radius({ref_of(field_), is_polytope ? &planes_ : nullptr});
  detail::set_corners(corners_, partner);
  if (is_polytope) {
    const float margin = number(shape.getMargin());  // which rounds it
    partner.hull = {planes_.hull_points(), margin};
    const std::size_t count = partner.hull.places.size();
    // Those of a hull of many are facets, but for sharp ones.
    const bool are_few = count > 0 && count <= detail::kMostCorners;
    partner.corners = are_few ? partner.hull : detail::Corners{planes_.sharp_corners(), margin};
    if (partner.corners.places.empty()) partner.corners = planes_.spheres();
  }
  return partner;
}

Status PairPartner::find(const QueryOptions& options, std::span<const detail::ContactPlace> known,
                         detail::SheetContacts& found) {
  return find_triangle_contacts(*pair_, options, known, triangles_, found);
}

void PairPartner::slide(const detail::PlacedField& distances, detail::Slides& slides) const {
  slides.search_each(distances,
                     [&](const Contact& contact) { return SheetField(triangles_.near, contact, 2 * slides.ring()); });
}

}  // namespace vps::bullet

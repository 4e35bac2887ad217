// SPDX-License-Identifier: Zlib
// Describes Bullet's shapes as partners.
#include "runtime/bullet/partners/partner.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>

#include "runtime/bullet/body_motion.h"

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

// Corners of a box, or of a hull of few corners.
detail::Corners corners_of(const btCollisionShape& shape, std::array<Vec3, detail::kMostCorners>& places) {
  const int type = shape.getShapeType();
  if (type != BOX_SHAPE_PROXYTYPE && type != CONVEX_HULL_SHAPE_PROXYTYPE) return {};
  const auto& solid = static_cast<const btPolyhedralConvexShape&>(shape);
  const auto count = static_cast<std::size_t>(solid.getNumVertices());
  if (count > places.size()) return {};
  for (std::size_t i = 0; i < count; ++i) {
    btVector3 vertex;
    solid.getVertex(static_cast<int>(i), vertex);
    places[i] = to_vec3(vertex);
  }
  // The corners of a box are those of its faces; a hull is rounded by its margin.
  return {{places.data(), count}, type == BOX_SHAPE_PROXYTYPE ? 0 : number(solid.getMargin())};
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

// The effect of the forces of the step is included.
StepMotion motion_in_step(const PairBody& side, btScalar step) {
  const Velocity velocity = velocity_of(*side.object);
  const btVector3 gain = step * acceleration_of(*side.object);
  const btVector3& origin = side.object->getWorldTransform().getOrigin();
  StepMotion motion;
  for (int i = 0; i < 3; ++i) motion.centre[i] = static_cast<double>(origin[i]);
  motion.way = to_vec3(step * (velocity.linear + gain));
  motion.turn = to_vec3(step * velocity.angular);
  motion.fall = to_vec3(step * gain);
  // Bodies of triangles have no test of what arrives.
  motion.yields = inverse_mass(*side.object) > 0 && !is_triangle_mesh(side.shape->getShapeType());
  if (!velocity.angular.isZero()) {
    btVector3 centre;
    btScalar radius = 0;
    side.object->getCollisionShape()->getBoundingSphere(centre, radius);
    motion.radius = static_cast<float>(centre.length() + radius);
  }
  return motion;
}

}  // namespace

detail::StepPair in_step(const Pair& pair) {
  const Shape& shell = *pair.shell.vps;
  const Shape* const field = pair.field.vps;
  const double voxel = shell.info().voxel_size;
  // Fields of Bullet's convex shapes include their margins.
  const bool is_thick = field != nullptr || is_triangle_mesh(pair.field.shape->getShapeType());
  return {shell.pointshell(),
          shell.distances(),
          to_pose(pair.shell.world, pair.shell.asset_frame()),
          to_pose(pair.field.world, field_frame(pair.field)),
          voxel,
          field != nullptr ? std::min(voxel, field->info().voxel_size) : voxel,
          number(shell.getMargin() + (is_thick ? pair.field.shape->getMargin() : 0)),
          foundation_of(pair).stiffness > 0 ? StepUse::springs : StepUse::constraints,
          shell.segment_level()};
}

void add_motions(const Pair& pair, btScalar step, StepMotion (&motions)[2], detail::StepPair& out) {
  if (pair.shell.object->getRestitution() * pair.field.object->getRestitution() > 0) return;
  motions[0] = motion_in_step(pair.shell, step);
  motions[1] = motion_in_step(pair.field, step);
  out.shell_motion = &motions[0];
  out.field_motion = &motions[1];
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

detail::PlacedBox box_of(const PairBody& body) {
  btVector3 low;
  btVector3 high;
  body.shape->getAabb(btTransform::getIdentity(), low, high);
  return {to_pose(body.world, btTransform::getIdentity()), to_vec3(low), to_vec3(high)};
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
  return with_radius({ref_of(field_), is_polytope ? &planes_ : nullptr, nullptr, corners_of(shape, corners_)});
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

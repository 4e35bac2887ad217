// SPDX-License-Identifier: Zlib
/// @file Bullet's own convex shapes and planes as fields that a pointshell can meet. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/partners/convex_planes.h"

namespace vps::bullet {

/// Whether on_partner supports a type of shape.
inline bool is_partner_field(int type) {
  return btBroadphaseProxy::isConvex(type) || type == STATIC_PLANE_PROXYTYPE;
}

/// Rotation that takes z, the axis of solids of revolution, to another axis.
inline btTransform along_axis(int axis) {
  btMatrix3x3 basis(0, 0, 0, 0, 0, 0, 0, 0, 0);
  for (int i = 0; i < 3; ++i) basis[(axis + 1 + i) % 3][i] = 1;
  return btTransform(basis);
}

/// Calls run(field, frame) with the shape as a field, and the pose of the field's frame in the shape's. Boxes and
/// cylinders have sharp edges and Bullet's full size; cones and hulls are rounded by their margins, as in Bullet.
/// @param from  position of the shell, shape's frame. [m]
/// @return what `run` returns; bad_argument where is_partner_field is false
template <class Run>
Status on_partner(const btCollisionShape& shape, const btVector3& from, ConvexPlanes& planes, Run run) {
  const auto number = [](btScalar value) { return static_cast<float>(value); };
  switch (shape.getShapeType()) {
    case BOX_SHAPE_PROXYTYPE: {
      const auto& box = static_cast<const btBoxShape&>(shape);
      return run(BoxField{to_vec3(box.getHalfExtentsWithMargin())}, btTransform::getIdentity());
    }
    case SPHERE_SHAPE_PROXYTYPE: {
      const auto& sphere = static_cast<const btSphereShape&>(shape);
      return run(SphereField{number(sphere.getRadius())}, btTransform::getIdentity());
    }
    case STATIC_PLANE_PROXYTYPE: {
      const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
      return run(HalfSpaceField{to_vec3(plane.getPlaneNormal()), number(plane.getPlaneConstant())},
                 btTransform::getIdentity());
    }
    case CAPSULE_SHAPE_PROXYTYPE: {
      const auto& capsule = static_cast<const btCapsuleShape&>(shape);
      return run(RevolvedField{RevolvedField::Profile::capsule, number(capsule.getRadius()),
                               number(capsule.getHalfHeight()), 0},
                 along_axis(capsule.getUpAxis()));
    }
    case CYLINDER_SHAPE_PROXYTYPE: {
      const auto& cylinder = static_cast<const btCylinderShape&>(shape);
      return run(RevolvedField{RevolvedField::Profile::cylinder, number(cylinder.getRadius()),
                               number(cylinder.getHalfExtentsWithMargin()[cylinder.getUpAxis()]), 0},
                 along_axis(cylinder.getUpAxis()));
    }
    case CONE_SHAPE_PROXYTYPE: {
      const auto& cone = static_cast<const btConeShape&>(shape);
      return run(RevolvedField{RevolvedField::Profile::cone, number(cone.getRadius()), number(cone.getHeight() / 2),
                               number(cone.getMargin())},
                 along_axis(cone.getConeUpIndex()));
    }
    default:
      if (!btBroadphaseProxy::isConvex(shape.getShapeType())) return Status::bad_argument;
      return run(planes.of(static_cast<const btConvexShape&>(shape), from), btTransform::getIdentity());
  }
}

}  // namespace vps::bullet

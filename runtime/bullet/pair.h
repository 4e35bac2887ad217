// SPDX-License-Identifier: Zlib
/// @file Who plays what in a pair of Bullet's, and where. Internal. Paper: Sec. 3.2.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {

inline const Shape* as_vps(const btCollisionShape* shape) {
  return shape->getShapeType() == kProxyType ? dynamic_cast<const Shape*>(shape) : nullptr;
}

/// One of the two bodies of a pair: a shape and where it lies. The wrapper's transform is the only one that is right
/// for children of compounds.
struct PairBody {
  const btCollisionShape* shape = nullptr;
  const btCollisionObject* object = nullptr;
  btTransform world;
  const Shape* vps = nullptr;  ///< null for Bullet's own shapes

  explicit PairBody(const btCollisionObjectWrapper* wrap)
      : PairBody(wrap->getCollisionShape(), wrap->getCollisionObject(), wrap->getWorldTransform()) {}
  PairBody(const btCollisionShape* of_shape, const btCollisionObject* of_object, const btTransform& at)
      : shape(of_shape), object(of_object), world(at), vps(as_vps(of_shape)) {}

  /// Takes the asset's frame to the shape's.
  [[nodiscard]] btTransform asset_frame() const { return translation(-vps->centre_of_mass()); }
};

struct Pair {
  PairBody shell, field;
};

/// The side with fewer points gives the pointshell, the first if they are equal; if it cannot, the other. Where neither
/// can, the query says so.
/// @pre one of them is a Shape
inline Pair assign_roles(const PairBody& first, const PairBody& second) {
  if (second.vps == nullptr) return {first, second};
  if (first.vps == nullptr) return {second, first};
  const auto can = [](const Shape& shell, const Shape& map) {
    return shell.pointshell().points > 0 && map.voxelmap().field != Field::none;
  };
  if (!can(*second.vps, *first.vps)) return {first, second};
  if (!can(*first.vps, *second.vps)) return {second, first};
  return second.vps->pointshell().points < first.vps->pointshell().points ? Pair{second, first} : Pair{first, second};
}

/// The finer of the two: what distances between contacts are measured by. [m]
inline btScalar voxel_size(const Pair& pair) {
  const double shell = pair.shell.vps->asset().info().voxel_size;
  const double map = pair.field.vps != nullptr ? pair.field.vps->asset().info().voxel_size : shell;
  return static_cast<btScalar>(shell < map ? shell : map);
}

/// Points up to this far off the surface are contacts, so that a resting contact lives through the noise of a step.
/// With a whole voxel a bunny on a box tests five times the points, and its flickering manifold never comes to rest.
inline btScalar contact_distance(const Pair& pair) {
  return btScalar(0.1) * voxel_size(pair);
}

/// Points of the shell that are closer to each other touch the same place. [m]
inline btScalar beside(const Pair& pair) {
  return 2 * voxel_size(pair);
}

/// Bullet's concave shapes that hand out triangles.
inline bool is_triangle_mesh(int type) {
  return type == TRIANGLE_MESH_SHAPE_PROXYTYPE || type == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE ||
         type == MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE || type == TERRAIN_SHAPE_PROXYTYPE ||
         type == GIMPACT_SHAPE_PROXYTYPE;
}

/// By how much both shapes are thickened. [m]
inline float margin_of(const Pair& pair) {
  // Fields of Bullet's convex shapes have theirs already.
  const bool thick = pair.field.vps != nullptr || is_triangle_mesh(pair.field.shape->getShapeType());
  const btScalar field = thick ? pair.field.shape->getMargin() : btScalar(0);
  return static_cast<float>(pair.shell.vps->getMargin() + field);
}

/// What contacts press by; a stiffness of 0: they are rigid.
inline const PenaltyLaw& foundation_of(const Pair& pair) {
  const PenaltyLaw& own = pair.shell.vps->foundation();
  return own.stiffness > 0 || pair.field.vps == nullptr ? own : pair.field.vps->foundation();
}

}  // namespace vps::bullet

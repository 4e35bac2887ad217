// SPDX-License-Identifier: Zlib
/// @file Roles and poses of the two bodies of a Bullet pair. Internal. Paper: Sec. 3.2.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <typeinfo>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/vps_bullet.h"
#include "runtime/contacts/gives_pointshell.h"

namespace vps::bullet {

/// Null for another class, which may have Shape's shape type. Called for each pair in each step: a dynamic_cast takes
/// as long as the rest of a pair that is apart.
inline const Shape* as_vps(const btCollisionShape* shape) {
  const bool is_vps = shape->getShapeType() == kProxyType && typeid(*shape) == typeid(Shape);
  return is_vps ? static_cast<const Shape*>(shape) : nullptr;
}

/// One of the two bodies of a pair: a shape and its pose. The pose comes from the wrapper, as only the wrapper's is
/// right for children of compounds.
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
  [[nodiscard]] const btTransform& asset_frame() const { return vps->asset_frame(); }
};

struct Pair {
  PairBody shell, field;
};

/// The side with the finer voxels gives the pointshell: contacts between samples need samples where the other body is
/// round. Of sides that are about as fine, the one with fewer points gives it (Sec. 3.2); the first if both have as
/// many. If that side cannot, the other gives it. If neither can, the query reports it.
/// @pre one of them is a Shape
inline Pair assign_roles(const PairBody& first, const PairBody& second) {
  if (second.vps == nullptr) return {first, second};
  if (first.vps == nullptr) return {second, first};
  const auto can = [](const Shape& shell, const Shape& map) {
    return shell.pointshell().points > 0 && map.voxelmap().field != Field::none;
  };
  if (!can(*second.vps, *first.vps)) return {first, second};
  if (!can(*first.vps, *second.vps)) return {second, first};
  const auto side = [](const Shape& shape) { return ShellSide{shape.info().voxel_size, shape.pointshell().points}; };
  return gives_pointshell(side(*first.vps), side(*second.vps)) ? Pair{first, second} : Pair{second, first};
}

/// Whether each body's points are sought in the other one: the shell has few points inside its faces, and an edge of
/// the other body may lie between them. Then the points inside faces are not needed: what they could touch is an edge,
/// a corner or a curved place of the other body, or another face, and faces meet at the edge of one of them first.
inline bool needs_both_roles(const Pair& pair) {
  return pair.shell.vps->pointshell().face_points != nullptr && pair.field.vps != nullptr &&
         pair.field.vps->pointshell().points > 0 && pair.shell.vps->voxelmap().field != Field::none;
}

/// The smaller voxel size of the two: the scale for distances between contacts. [m]
inline btScalar voxel_size(const Pair& pair) {
  const double shell = pair.shell.vps->info().voxel_size;
  const double map = pair.field.vps != nullptr ? pair.field.vps->info().voxel_size : shell;
  return static_cast<btScalar>(shell < map ? shell : map);
}

/// Points up to this far off the surface are contacts, so that a resting contact survives the noise of a step. With a
/// whole voxel, a bunny on a box tests five times as many points, and its flickering manifold never comes to rest. [m]
inline btScalar contact_distance(const Pair& pair) {
  return btScalar(0.1) * voxel_size(pair);
}

/// Bullet's concave shapes that hand out triangles.
inline bool is_triangle_mesh(int type) {
  return type == TRIANGLE_MESH_SHAPE_PROXYTYPE || type == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE ||
         type == MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE || type == TERRAIN_SHAPE_PROXYTYPE ||
         type == GIMPACT_SHAPE_PROXYTYPE;
}

/// Sum of the margins of both shapes, without one that the field already includes. [m]
inline float margin_of(const Pair& pair) {
  // Fields of Bullet's convex shapes include their margins.
  const bool thick = pair.field.vps != nullptr || is_triangle_mesh(pair.field.shape->getShapeType());
  const btScalar field = thick ? pair.field.shape->getMargin() : btScalar(0);
  return static_cast<float>(pair.shell.vps->getMargin() + field);
}

/// Penalty law of the pair's contacts. A stiffness of 0: they are rigid.
inline const PenaltyLaw& foundation_of(const Pair& pair) {
  const PenaltyLaw& own = pair.shell.vps->foundation();
  return own.stiffness > 0 || pair.field.vps == nullptr ? own : pair.field.vps->foundation();
}

}  // namespace vps::bullet

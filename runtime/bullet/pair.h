// SPDX-License-Identifier: Zlib
/// @file Roles and poses of the two bodies of a Bullet pair. Internal. Paper: Sec. 3.2.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <typeinfo>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/vps_bullet.h"
#include "runtime/contacts/pair_roles.h"

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
  const btCollisionShape* shape;
  const Shape* vps;  ///< null for Bullet's own shapes
  const btCollisionObject* object;
  const btTransform& world;  ///< not copied

  explicit PairBody(const btCollisionObjectWrapper* wrap)
      : PairBody(wrap->getCollisionShape(), wrap->getCollisionObject(), wrap->getWorldTransform()) {}
  PairBody(const btCollisionShape* of_shape, const btCollisionObject* of_object, const btTransform& at)
      : shape(of_shape), vps(as_vps(of_shape)), object(of_object), world(at) {}
  PairBody(const btCollisionShape*, const btCollisionObject*, btTransform&&) = delete;

  /// Takes the asset's frame to the shape's.
  [[nodiscard]] const btTransform& asset_frame() const { return vps->asset_frame(); }
};

struct Pair {
  PairBody shell, field;
  bool both = false;  ///< each body's points are sought in the other one
};

/// If neither body can give its points, the query reports it.
/// @pre one of them is a Shape
inline Pair assign_roles(const PairBody& first, const PairBody& second) {
  if (second.vps == nullptr) return {first, second};
  if (first.vps == nullptr) return {second, first};
  const auto side = [](const Shape& shape) {
    return detail::RoleSide{&shape.pointshell(), shape.voxelmap().field != Field::none, shape.info().voxel_size};
  };
  const detail::PairRoles roles = detail::roles_of(side(*first.vps), side(*second.vps));
  return roles.first_gives ? Pair{first, second, roles.both_give} : Pair{second, first, roles.both_give};
}

/// Penalty law of the pair's contacts. A stiffness of 0: they are rigid.
inline const PenaltyLaw& foundation_of(const Pair& pair) {
  const PenaltyLaw& own = pair.shell.vps->foundation();
  return own.stiffness > 0 || pair.field.vps == nullptr ? own : pair.field.vps->foundation();
}

}  // namespace vps::bullet

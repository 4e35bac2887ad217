// SPDX-License-Identifier: Zlib
/// @file The shapes that a collision object is made of. Internal.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>

namespace vps::bullet {

/// A shape that is not a compound, and its pose in its object's frame.
struct Leaf {
  const btCollisionShape* shape;
  btTransform local;
};

/// Calls visit(Leaf) for the shape itself, or for the children of a compound, recursively.
template <class Visit>
void for_each_leaf(const Leaf& leaf, const Visit& visit) {
  if (!leaf.shape->isCompound()) return visit(leaf);
  const auto* const compound = static_cast<const btCompoundShape*>(leaf.shape);
  for (int i = 0; i < compound->getNumChildShapes(); ++i) {
    for_each_leaf({compound->getChildShape(i), leaf.local * compound->getChildTransform(i)}, visit);
  }
}
template <class Visit>
void for_each_leaf(const btCollisionObject& object, const Visit& visit) {
  for_each_leaf(Leaf{object.getCollisionShape(), btTransform::getIdentity()}, visit);
}

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file Any convex shape of Bullet's as a polytope. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>

#include <vector>

#include "runtime/vps_runtime.h"

namespace vps::bullet {

/// Planes that a convex shape touches from within, its margin included: those of the faces where it has corners, and
/// others all round. So penetration() is exact inside of polyhedra, and nowhere too small.
class ConvexPlanes {
 public:
  /// Builds the planes, unless they are this shape's already.
  PolytopeField of(const btConvexShape& shape);

 private:
  const btConvexShape* shape_ = nullptr;
  btVector3 scaling_{0, 0, 0};
  btScalar margin_ = 0;
  int corners_ = 0;
  std::vector<HalfSpaceField> planes_;
};

/// Puts right what the planes say of a contact outside the shape's core, by GJK: depth and direction. Within the core,
/// which is the shape without its margin, the planes are left their word.
/// @param contact  shape's frame
void make_exact(const btConvexShape& shape, const PolytopeField& planes, Contact& contact);

}  // namespace vps::bullet

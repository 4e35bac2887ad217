// SPDX-License-Identifier: Zlib
/// @file Any convex shape of Bullet's as a polytope. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>

#include <memory>
#include <vector>

#include "runtime/bullet/partners/triangles.h"
#include "runtime/vps_runtime.h"

namespace vps::bullet {

/// Planes that a convex shape touches from within, its margin included: those of the faces where it has corners, and
/// others all round. So penetration() is exact inside of polyhedra, and nowhere too small.
class ConvexPlanes {
 public:
  /// Builds the planes, unless they are this shape's already. A body without faces gets one more plane each time, where
  /// it is nearest to `from`: its planes must not be cached.
  /// @param from  where the shell is, shape's frame. [m]
  PolytopeField of(const btConvexShape& shape, const btVector3& from);
  [[nodiscard]] bool has_faces() const { return faces_ > 0; }

  /// Penetration and direction of a contact with the shape of the last call of `of`: of the face that looks most
  /// towards the shell where several are as near; by the nearest place outside the core, which is the shape without its
  /// margin. Deep inside of round shapes the planes keep their word.
  /// @param contact  shape's frame; its inward_normal is the shell's, and becomes the direction
  /// @param alike    penetrations that differ by no more count as the same. [m]
  void finish(Contact& contact, float alike) const;

 private:
  void build(const btConvexShape& shape);
  // From outside the core, by its faces, or by GJK where it has none. `contact`: its position says where; gets
  // penetration and direction.
  bool find_nearest(Contact& contact) const;
  bool find_nearest_of_faces(Contact& contact) const;

  const btConvexShape* shape_ = nullptr;
  btVector3 scaling_{0, 0, 0};
  btScalar margin_ = 0;
  std::uint64_t corners_ = 0;
  std::size_t faces_ = 0;  // planes of faces come first
  std::vector<HalfSpaceField> planes_;
  std::vector<Triangle> triangles_;              // of the faces, without the margin
  std::unique_ptr<btMultiSphereShape> thinner_;  // a copy for GJK, whose margin is no larger than its spheres
};

/// Of the faces that a point lies equally deep below, the one that looks most along the shell's inward normal: at an
/// edge the nearest may be one that the shell hardly touches.
/// @param contact  as above
/// @return false, and nothing changed, when there are no faces
bool face_shell(std::span<const HalfSpaceField> faces, float alike, Contact& contact);

}  // namespace vps::bullet

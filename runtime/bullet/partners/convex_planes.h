// SPDX-License-Identifier: Zlib
/// @file Bullet's convex shapes as polytopes. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btConvexShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>

#include <memory>
#include <span>
#include <vector>

#include "runtime/bullet/partners/triangles.h"
#include "runtime/contacts/step_pair.h"

namespace vps::bullet {

/// Supporting planes of a convex shape, its margin included: those of its faces where it has corners, and others in all
/// directions. So penetration() is exact inside polyhedra, and never too small.
class ConvexPlanes final : public detail::ConvexBody {
 public:
  /// Builds the planes, unless they already belong to this shape. A body without faces gets a new last plane in each
  /// call, where it is nearest to `from`: contacts with its planes must not be cached.
  /// @param from  position of the shell, shape's frame. [m]
  PolytopeField of(const btConvexShape& shape, const btVector3& from);
  [[nodiscard]] bool has_faces() const override { return faces_ > 0; }

  /// All points of a btConvexHullShape, the one of the last call of `of`, without its margin; none of one of more than
  /// 1024, and none of other shapes. [m]
  [[nodiscard]] std::span<const Vec3> hull_points() const { return hull_points_; }
  /// Corners of the shape of the last call of `of` that are as sharp as a cube's, without its margin: 16 at most, the
  /// sharpest. [m]
  [[nodiscard]] std::span<const Vec3> sharp_corners() const { return sharp_; }
  /// The spheres of a btMultiSphereShape: centres and radii; none of other shapes. [m]
  [[nodiscard]] detail::Corners spheres() const { return {sphere_centres_, 0, sphere_radii_}; }

  /// V at a place. Outside the core (the shape without its margin) it is that of the nearest place on it.
  /// @param bound  V of the planes there. [m]
  [[nodiscard]] float penetration(Vec3 place, float bound) const override;

  /// Sets penetration and direction of a contact with the shape of the last call of `of`. Outside the core they come
  /// from the nearest place on it. Inside, they come from a face: of several that are
  /// equally near, from the one that most faces the shell. Inside the core of a body without faces, they come from the
  /// planes.
  /// @param contact  shape's frame; its inward_normal is the shell's on entry, and the direction on return
  /// @param alike    penetrations that differ by no more than this count as the same. [m]
  void finish(Contact& contact, float alike) const override;

 private:
  void build(const btConvexShape& shape);
  // Whether the planes' V at a contact is that of the shape. `out` is the nearest plane's normal.
  [[nodiscard]] bool is_exact(const Contact& contact, Vec3 out) const;
  // Sets penetration and direction of a contact outside the core, from the place nearest to its position: by the faces,
  // or by GJK where there are none.
  bool find_nearest(Contact& contact) const;
  bool find_nearest_of_faces(Contact& contact) const;

  const btConvexShape* shape_ = nullptr;
  btVector3 scaling_{0, 0, 0};
  btScalar margin_ = 0;
  std::uint64_t corners_ = 0;
  std::size_t faces_ = 0;  // number of planes of faces, which come first
  std::vector<HalfSpaceField> planes_;
  std::vector<Vec3> hull_points_, sharp_, sphere_centres_;
  std::vector<float> sphere_radii_;
  std::vector<Triangle> triangles_;              // of the faces, without the margin
  std::unique_ptr<btMultiSphereShape> thinner_;  // copy for GJK with a margin no larger than any sphere
};

}  // namespace vps::bullet

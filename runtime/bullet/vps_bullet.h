// SPDX-License-Identifier: Zlib
/// @file Baked assets as collision shapes in an unpatched Bullet. Paper: Sec. 3.2.
///
///     auto asset = std::make_shared<vps::Asset>();
///     if (vps::Asset::open("bunny.vps.hdf", *asset) != vps::Status::ok) ...
///     vps::bullet::register_algorithm(*dispatcher);      // once, before the first step
///     vps::bullet::Shape shape(asset);                   // then use it like any btCollisionShape
///
/// Answered exactly: Shape against Shape, btBoxShape, btSphereShape and btStaticPlaneShape. Every other convex shape
/// meets the shape's surfels (see processAllTriangles). Concave shapes of Bullet's own (triangle meshes, terrain,
/// GImpact) do not collide with it yet.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <atomic>
#include <memory>

#include "runtime/vps_runtime.h"

namespace vps::bullet {

// Bullet does not notice when programs and libraries differ in the precision of btScalar. With this they do not link.
#ifdef BT_USE_DOUBLE_PRECISION
inline namespace float64 {
#else
inline namespace float32 {
#endif

/// One asset as a shape; plays the voxelmap, the pointshell or both, by what the asset holds. In a pair of two, the one
/// with fewer points gives the pointshell. Any number of bodies may share a shape, any number of shapes an asset.
///
/// Frame: Bullet puts a body's origin at its centre of mass, so the shape's frame is the asset's frame moved there;
/// axes stay parallel. A point p of the mesh lies at p - centre_of_mass() in the body.
class Shape final : public btConcaveShape {
 public:
  /// @pre asset is open
  explicit Shape(std::shared_ptr<const Asset> asset);

  [[nodiscard]] const Asset& asset() const { return *asset_; }
  /// Origin of the shape's frame, in the asset's frame. [m]
  [[nodiscard]] const btVector3& centre_of_mass() const { return centre_of_mass_; }
  [[nodiscard]] const VoxelmapView& voxelmap() const { return map_; }
  [[nodiscard]] const PointshellView& pointshell() const { return shell_; }

  /// Segmented contacts (Sec. 2.4) when this shape gives the pointshell: about this many segments, each with a manifold
  /// of its deepest point. 0: one manifold of up to four points (Sec. 3.2).
  void set_segments(std::uint32_t wished) { wished_segments_ = wished; }
  [[nodiscard]] std::uint32_t segments() const { return wished_segments_; }
  /// Tree level whose number of clusters is nearest to the wish; 0 for the regular traverse.
  [[nodiscard]] std::uint32_t segment_level() const;

  /// Why the last pair with this shape could not be answered: missing_part when neither shape can play the other part,
  /// bad_pose, ... `ok` when nothing went wrong so far.
  [[nodiscard]] Status status() const { return status_.load(std::memory_order_relaxed); }
  void report(Status status) const { status_.store(status, std::memory_order_relaxed); }

  // btCollisionShape
  void getAabb(const btTransform& transform, btVector3& low, btVector3& high) const override;
  /// From the asset's volume integrals, scaled to `mass`. Products of inertia are left out: Bullet has no place for
  /// them.
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  /// Only (1,1,1): bake the mesh at the size you need. Anything else is not applied, and status() says bad_argument.
  void setLocalScaling(const btVector3& scaling) override;
  const btVector3& getLocalScaling() const override { return scaling_; }
  const char* getName() const override { return "VPS"; }
  /// Surfels: for each point of the shell whose neighbourhood meets the box, a triangle in its tangent plane whose
  /// inscribed circle has the covering radius, so that together they cover the surface. For rays, debug drawing and
  /// convex shapes without an algorithm of their own. Index: number of the point.
  void processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override;

 private:
  std::shared_ptr<const Asset> asset_;
  VoxelmapView map_;
  PointshellView shell_;
  btVector3 centre_of_mass_;
  btVector3 scaling_{1, 1, 1};
  std::uint32_t wished_segments_ = 0;
  mutable std::atomic<Status> status_{Status::ok};
};
}

/// Type slot of Shape. SDF_SHAPE_PROXYTYPE equals CUSTOM_CONCAVE_SHAPE_TYPE, so Bullet would cast us to its own class
/// there.
inline constexpr int kProxyType = FAST_CONCAVE_MESH_PROXYTYPE;

/// Enters the algorithm into both tables of a stock dispatcher, in both orders. Call it after GImpact's registration.
void register_algorithm(btCollisionDispatcher& dispatcher);

}  // namespace vps::bullet

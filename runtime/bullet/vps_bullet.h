// SPDX-License-Identifier: Zlib
/// @file Baked assets as collision shapes in an unpatched Bullet. Paper: Sec. 3.2.
///
///     auto asset = std::make_shared<vps::Asset>();
///     if (vps::Asset::open("bunny.vps.hdf", *asset) != vps::Status::ok) ...
///     vps::bullet::register_algorithm(*dispatcher);      // once, before the first step
///     vps::bullet::Shape shape(asset);                   // then use it like any btCollisionShape
///
/// A Shape has contacts with other Shapes (both may move), with every convex shape and plane of Bullet, and with its
/// triangle meshes, terrain and btGImpactMeshShape, moving or not. A triangle has no solid side: it pushes a Shape out
/// on the nearer side. Compounds, ghost objects and contact tests work as with Bullet's own shapes. For rays, convex
/// sweeps and debug drawing see processAllTriangles.
///
/// While bodies are apart, a pair notices new poses, scalings, margins and triangles, and other shapes. It may miss
/// other changes in place, as of a hull's corners: as Bullet advises, remove the body first, or call
/// cleanProxyFromPairs after.
///
/// Kinematic bodies are taken to go on as they came to their pose, as Bullet's solver takes them: what lies less than
/// that way ahead of one is met before it gets there. Of a kinematic body that is teleported set the interpolation
/// transform, too, or the jump is such a way.
#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletDynamics/Dynamics/btActionInterface.h>
#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/vps_contacts.h"

namespace vps::bullet {

/// "vps:" and a hash of the asset's contents. It does not depend on where the file lies.
[[nodiscard]] std::string asset_key(const Asset& asset);

/// Which part of its asset a shape uses.
enum class Part : std::uint8_t {
  mixed,       ///< either: in each pair, the shape with the finer voxels gives the pointshell
  pointshell,  ///< meets voxelmaps and Bullet's own shapes
  voxelmap,    ///< meets pointshells
};

/// Axes of a shape's frame. Bullet keeps a body's moments of inertia about its axes, and no products of inertia.
enum class Axes : std::uint8_t {
  of_asset,   ///< parallel to the mesh's axes. Products of inertia are left out
  principal,  ///< the principal axes of inertia: a body turns as it should. As btCompoundShape's
              ///< calculatePrincipalAxisTransform does; of all such axes, those nearest to the mesh's
};

// Bullet does not detect that a program and a library differ in the precision of btScalar. This namespace makes linking
// them fail.
#ifdef BT_USE_DOUBLE_PRECISION
inline namespace float64 {
#else
inline namespace float32 {
#endif

/// One asset as a shape: the paper's Pointshell, Voxelmap and Mixed. Any number of bodies may share a shape, any number
/// of shapes an asset.
///
/// A margin (default 0) thickens the body on all sides.
///
/// Points of Bullet's manifolds: `m_index0` and `m_index1` are the child of a compound as always, else -1; `m_partId0`
/// and `m_partId1` are one number of the contact. Bullet's callbacks for contacts are called as for its own shapes.
/// Soft bodies are not supported.
///
/// Frame: Bullet puts a body's origin at its centre of mass, so the shape's frame lies there, with the chosen Axes.
/// mesh_pose and body_pose convert between the poses of the mesh and of the body.
class Shape final : public btConcaveShape {
 public:
  /// @pre asset is open
  explicit Shape(std::shared_ptr<const Asset> asset, Part part = Part::mixed, Axes axes = Axes::of_asset);

  [[nodiscard]] const Asset& asset() const { return *asset_; }
  /// The asset's facts at the shape's scale.
  [[nodiscard]] const AssetInfo& info() const { return info_; }
  /// Origin of the shape's frame, in the asset's frame at the shape's scale. [m]
  [[nodiscard]] const btVector3& centre_of_mass() const { return centre_of_mass_; }
  /// Takes the asset's frame, which is the scaled mesh's, to the shape's. With Axes::of_asset: moves it by
  /// -centre_of_mass().
  [[nodiscard]] const btTransform& asset_frame() const { return asset_frame_; }
  /// Pose at which the mesh of a body is drawn. @param body  world transform of a body with this shape
  [[nodiscard]] btTransform mesh_pose(const btTransform& body) const { return body * asset_frame_; }
  /// World transform of a body with this shape. @param mesh  pose of the mesh's frame
  [[nodiscard]] btTransform body_pose(const btTransform& mesh) const { return mesh * asset_frame_.inverse(); }
  [[nodiscard]] const VoxelmapView& voxelmap() const { return map_; }
  [[nodiscard]] const PointshellView& pointshell() const { return shell_; }
  /// Distances to the shape's own surface, for any part: they place contacts between the points of its shell.
  /// Field::none without `scaled` or `real` distances in the asset and in use.
  [[nodiscard]] const VoxelmapView& distances() const { return distances_; }

  /// Segmented contacts (Sec. 2.4) when this shape gives the pointshell. There are about this many segments. Each has
  /// up to three contacts: its deepest point, to a fiftieth of a voxel, and, at rest and not on triangle meshes, points
  /// of earlier steps. 0: one manifold of up to four points (Sec. 3.2).
  void set_segments(std::uint32_t wished) { wished_segments_ = wished; }
  [[nodiscard]] std::uint32_t segments() const { return wished_segments_; }
  /// Tree level whose number of clusters is nearest to the set number of segments; 0 for the regular traverse.
  [[nodiscard]] std::uint32_t segment_level() const;

  /// Soft contacts instead of Bullet's rigid ones, when this shape gives the pointshell or the other shape has no law.
  /// Each contact is a spring and a damper of Bullet's solver; its stiffness is proportional to the area it represents
  /// (the paper's future work, Sec. 5). A stiffness of 0, the default, is rigid. Only without segments, and only in
  /// worlds with m_splitImpulse = 0.
  /// @return bad_argument, and no change, for a law that is negative or not finite
  Status set_foundation(const PenaltyLaw& law);
  [[nodiscard]] const PenaltyLaw& foundation() const { return foundation_; }
  /// Flat parts of the shell, at the shape's scale: none before a law is set.
  [[nodiscard]] std::span<const FlatPatch> flat_patches() const { return patches_; }

  /// A name for messages and files; empty by default.
  void set_name(const std::string& name) { label_ = asset_key(*asset_) + (name.empty() ? "" : " " + name); }
  /// The asset_key, followed by a space and the name if there is one.
  [[nodiscard]] const std::string& label() const { return label_; }

  /// Why the last failed pair with this shape has no contacts: missing_part when neither shape can play the other part,
  /// bad_pose, ... Also bad_argument after a refused scaling, until the next one that is applied. `ok` when nothing has
  /// failed so far.
  [[nodiscard]] Status status() const { return status_.load(std::memory_order_relaxed); }
  /// No other shape of the process has or had this number. Internal.
  [[nodiscard]] std::uint64_t serial() const { return serial_; }
  /// Stores a status, and sends a message the first time. Internal.
  void report(Status status) const;
  /// Sends a message, the first time only, that this shape has met a dispatcher without its algorithm. Internal.
  void report_not_registered() const;

  /// Largest product of inertia about the shape's axes, which Bullet leaves out, as a share of the largest moment; 0
  /// with Axes::principal. [-]
  [[nodiscard]] double lost_inertia() const;

  // btCollisionShape
  void getAabb(const btTransform& transform, btVector3& low, btVector3& high) const override;
  void getBoundingSphere(btVector3& centre, btScalar& radius) const override;
  /// From the asset's volume integrals, scaled to `mass`, about the shape's axes. Sends a message when mass and volume
  /// give an implausible density, as in a world in other units.
  void calculateLocalInertia(btScalar mass, btVector3& inertia) const override;
  /// The same positive factor along all axes, within kLeastScale and kMostScale: the mesh's size times that, about the
  /// centre of mass. Anything else is not applied, and a message says so. As with any shape of Bullet, set the mass
  /// properties of its bodies again and update their bounds. Not during a step.
  void setLocalScaling(const btVector3& scaling) override;
  /// Whether the last requested scaling was refused. Internal.
  [[nodiscard]] bool refuses_scaling() const { return refuses_scaling_; }
  const btVector3& getLocalScaling() const override { return scaling_; }
  const char* getName() const override { return "VPS"; }
  /// Bullet's importer knows only its own shapes: in a file this is a box of the same size, named label(). See
  /// reattach.
  int calculateSerializeBufferSize() const override;
  const char* serialize(void* buffer, btSerializer* serializer) const override;
  /// The distance field answers rays, to a thousandth of a voxel: with the first place inside, or with the start if it
  /// is inside. Convex sweeps, debug drawing, and rays without a distance field get surfels: a triangle for each point
  /// of the shell whose neighbourhood meets the box. The triangle lies in the point's tangent plane, and its inscribed
  /// circle has the covering radius, so that all together cover the surface. Index: number of the point.
  void processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override;

 private:
  enum class Notice : std::uint8_t { missing_part, bad_pose, other, units, scaling, not_registered };
  void send_once(Notice notice, const std::string& text) const;
  void look_for_first_step(const btTransform& transform) const;
  void set_scale(btScalar scale);
  void find_patches();
  /// Moments about the shape's axes, for a mass. [kg m^2]
  std::array<double, 3> moments_of(double mass) const;

  const std::uint64_t serial_;
  std::shared_ptr<const Asset> asset_;
  const Part part_;
  const Axes axes_;
  AssetInfo info_;
  VoxelmapView map_, distances_;
  PointshellView shell_;
  btVector3 centre_of_mass_;
  btTransform asset_frame_;
  btVector3 box_centre_;           // of the asset's bounds, shape's frame. [m]
  btVector3 box_half_;             // their half sizes along the asset's axes, without the margin. [m]
  std::array<double, 3> moments_;  // about the shape's axes, at unit density. [m^5]
  btVector3 scaling_{1, 1, 1};
  bool refuses_scaling_ = false;
  std::uint32_t wished_segments_ = 0;
  PenaltyLaw foundation_;
  std::vector<FlatPatch> patches_;
  std::string label_;
  mutable std::atomic<Status> status_{Status::ok};
  mutable std::atomic<std::uint32_t> sent_{0};  // bits of Notice
  // Hash of the transform of the first getAabb call made before any dispatcher was registered; 0: no such call yet.
  mutable std::atomic<std::uint64_t> first_seen_{0};
};

struct ContinuousMotionOptions {
  float free_vx = 0.5F;  ///< bodies that move less in a step are left alone. [Limits: value >= 0] [Units: vx]
  /// Distance queries per pair and step, and up to four times as many where bodies move along each other.
  /// [Limits: value >= 1]
  std::uint32_t max_iterations = 64;
};

/// Keeps fast bodies from passing through walls; Bullet does this for convex bodies only. After each step, a body that
/// would have gone through or into another is put back to where they touch, by conservative advancement (Mirtich 1996).
/// It keeps its velocity for the next step's contact. Works for pairs with a Shape; both may move and turn. It does
/// nothing against Bullet's triangle meshes. Kinematic bodies stop others, but are not stopped.
///
///     vps::bullet::ContinuousMotion continuous;
///     world->addAction(&continuous);          // removeAction switches it off
class ContinuousMotion final : public btActionInterface {
 public:
  explicit ContinuousMotion(const ContinuousMotionOptions& options = {}) : options_(options) {}
  void updateAction(btCollisionWorld* world, btScalar step) override;
  void debugDraw(btIDebugDraw*) override {}
  /// How many times a body has been put back.
  [[nodiscard]] std::uint64_t stops() const { return stops_; }

 private:
  const ContinuousMotionOptions options_;
  const btDispatcher* checked_ = nullptr;  // its registration has been checked
  std::uint64_t stops_ = 0;
};
}

/// Replaces the boxes that represent Shapes in a world loaded from a file, also as children of compounds. A body gets
/// its shape's inertia: Bullet's importer has given it the box's.
/// @param shapes  shapes to put back; boxes of other assets stay
/// @return how many boxes were replaced
int reattach(btCollisionWorld& world, std::span<Shape* const> shapes);

/// A setting of a world that harms its Shapes, and what to set instead.
struct Advice {
  const btCollisionObject* object = nullptr;  ///< owner of the setting; null: the world
  std::string setting;                        ///< its name in code: "m_splitImpulsePenetrationThreshold"
  std::string text;                           ///< what it does, and what to set
};

/// Checks a world before its first step, or at any time: dispatcher, solver, units, margins, speeds, scaling, missing
/// parts. Empty when all is well. Each setting is reported once.
/// @param step  internal step of stepSimulation. [s]
[[nodiscard]] std::vector<Advice> lint(btDiscreteDynamicsWorld& world, btScalar step);

/// Receives one line, without a line end: what is wrong and what to do. Each shape sends each kind of message once.
using MessageHandler = void (*)(const char* line);
/// The default handler prints to stderr. Null drops messages. Any thread may call the handler.
void set_message_handler(MessageHandler handler);

/// The shape type of Bullet that Shape uses. CUSTOM_CONCAVE_SHAPE_TYPE is not possible: it equals SDF_SHAPE_PROXYTYPE,
/// and Bullet casts shapes of that type to its own class.
inline constexpr int kProxyType = FAST_CONCAVE_MESH_PROXYTYPE;

/// Registers the algorithm in both tables of a stock dispatcher, for both orders of a pair. Call it after GImpact's
/// registration, which overwrites entries. Compounds with a Shape, and those that meet one, ask each child's algorithm;
/// other compounds keep Bullet's own: remove a body whose compound gets its first Shape, and add it again. Every
/// dispatcher must be registered. An unregistered one is reported in the first step if a Shape meets a convex shape of
/// Bullet, or if the program has registered no dispatcher at all. lint and ContinuousMotion report it in any world.
/// While bodies land or roll a pair has several manifolds, and Bullet calls gContactStartedCallback and
/// gContactEndedCallback for each: a program that counts contacts compares pairs of bodies from step to step.
void register_algorithm(btCollisionDispatcher& dispatcher);

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file Scenes that `vpsbake scene` has planned and baked, loaded into a Bullet world in one call.
///
///     vps::bullet::Scene scene = vps::bullet::load_scene("table.vps/table.vps.json", world);
///     if (!scene.error().empty()) ...
///     scene.find("nut")->applyCentralImpulse({0, 0, 1});
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "runtime/bullet/vps_bullet.h"

class btMultiBody;
class btMultiBodyLinkCollider;

namespace vps::bullet {

#ifdef BT_USE_DOUBLE_PRECISION
inline namespace float64 {
#else
inline namespace float32 {
#endif

struct LoadOptions {
  bool verify = false;  ///< read each asset whole and check all its hashes, as `vpsbake info` does
  /// Bodies that joints connect become btMultiBody, one for each tree of joints, with the joints' limits; this needs a
  /// btMultiBodyDynamicsWorld. Otherwise all bodies are rigid, and joints are left to the program's constraints.
  bool multibodies = false;
};

/// A joint of a multibody, for btMultiBodyJointMotor and the like.
struct JointPlace {
  btMultiBody* multibody = nullptr;  ///< null: there is no such joint
  int link = -1;
};

/// Owns the bodies and multibodies of a scene, their shapes and assets. Move-only.
class Scene {
 public:
  Scene();
  Scene(Scene&& other) noexcept;
  Scene& operator=(Scene&& other) noexcept;
  /// Removes the bodies from their world, which must still exist. The program removes its motors first.
  ~Scene();

  /// The manifest's name and one sentence without a full stop; empty when the scene was loaded.
  [[nodiscard]] const std::string& error() const;
  /// The rigid ones, in the order of the manifest.
  [[nodiscard]] std::span<const std::unique_ptr<btRigidBody>> bodies() const;
  /// Null when no rigid body has this name.
  [[nodiscard]] btRigidBody* find(std::string_view name) const;
  /// With LoadOptions::multibodies: a link or base with collision geometry; null when none has this name.
  [[nodiscard]] btMultiBodyLinkCollider* find_link(std::string_view name) const;
  /// With LoadOptions::multibodies.
  [[nodiscard]] JointPlace find_joint(std::string_view name) const;
  /// Present pose of the mesh's frame (the link's, for a URDF). Bullet's own transform is that of the centre of
  /// mass, and for dynamic bodies of the principal axes of inertia.
  /// @param body  a body or link of this scene
  [[nodiscard]] btTransform origin(const btCollisionObject& body) const;
  /// Time step that the scene was planned for. [s]
  [[nodiscard]] btScalar step() const;

 private:
  friend Scene load_scene(const std::string& manifest, btDiscreteDynamicsWorld& world, const LoadOptions& options);
  static Scene load(const std::string& manifest, btDiscreteDynamicsWorld& world, const LoadOptions& options);
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

/// Maps each asset once, with only the sections that a body of the plan uses. Registers the algorithm with the world's
/// dispatcher, adds the bodies with their groups and masks, and disables contacts between the pairs that the plan keeps
/// apart. Sets the gravity if the scene has one. The solver's settings are left to the program: see lint.
/// The manifest may come from an untrusted source. It is checked, it may only name files in its folder or below, and
/// its size has limits (docs/scene.md). The assets' indices are always checked, their payload hashes only with
/// `verify`.
/// @pre the world's broadphase has room for the bodies: btAxisSweep3 has a limit of its own
/// With `multibodies`, the links join the world with their groups and masks, too; motors are left to the program.
/// @return on failure, a scene whose `error` says what is wrong with the manifest or an asset; the world has no new
/// body then
[[nodiscard]] inline Scene load_scene(const std::string& manifest, btDiscreteDynamicsWorld& world,
                                      const LoadOptions& options = {}) {
  return Scene::load(manifest, world, options);
}
}

}  // namespace vps::bullet

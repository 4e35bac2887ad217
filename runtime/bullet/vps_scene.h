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

namespace vps::bullet {

#ifdef BT_USE_DOUBLE_PRECISION
inline namespace float64 {
#else
inline namespace float32 {
#endif

struct LoadOptions {
  bool verify = false;  ///< read each asset whole and check all its hashes, as `vpsbake info` does
};

/// Owns the bodies of a scene, their shapes and assets. Move-only.
class Scene {
 public:
  Scene();
  Scene(Scene&& other) noexcept;
  Scene& operator=(Scene&& other) noexcept;
  /// Removes the bodies from their world, which must still exist.
  ~Scene();

  /// One sentence without a full stop; empty when the scene was loaded.
  [[nodiscard]] const std::string& error() const;
  /// In the order of the manifest.
  [[nodiscard]] std::span<const std::unique_ptr<btRigidBody>> bodies() const;
  /// Null when no body has this name.
  [[nodiscard]] btRigidBody* find(std::string_view name) const;
  /// Present pose of the mesh's frame (the link's, for a URDF). Bullet's own transform is that of the centre of
  /// mass, and for dynamic bodies of the principal axes of inertia.
  /// @param body  one of `bodies`
  [[nodiscard]] btTransform origin(const btRigidBody& body) const;
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
/// @return on failure, a scene whose `error` says what is wrong with the manifest or an asset; the world is unchanged
[[nodiscard]] inline Scene load_scene(const std::string& manifest, btDiscreteDynamicsWorld& world,
                                      const LoadOptions& options = {}) {
  return Scene::load(manifest, world, options);
}
}

}  // namespace vps::bullet

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
  bool verify = false;  ///< compare every hash of the assets with their bytes, as `vpsbake info` does: reads them whole
};

/// Owns the bodies of a scene, their shapes and assets. Move-only.
class Scene {
 public:
  Scene();
  Scene(Scene&& other) noexcept;
  Scene& operator=(Scene&& other) noexcept;
  /// Takes the bodies out of their world, which has to be alive still.
  ~Scene();

  /// One sentence without a full stop; empty when the scene was loaded.
  [[nodiscard]] const std::string& error() const;
  /// In the order of the manifest.
  [[nodiscard]] std::span<const std::unique_ptr<btRigidBody>> bodies() const;
  /// Null when no body has this name.
  [[nodiscard]] btRigidBody* find(std::string_view name) const;
  /// Where the origin of the mesh (the link, for a URDF) lies now: Bullet's own transform is that of the centre of
  /// mass.
  /// @param body  one of `bodies`
  [[nodiscard]] btTransform origin(const btRigidBody& body) const;
  /// Of the simulation that the scene was planned for. [s]
  [[nodiscard]] btScalar step() const;

 private:
  friend Scene load_scene(const std::string& manifest, btDiscreteDynamicsWorld& world, const LoadOptions& options);
  static Scene load(const std::string& manifest, btDiscreteDynamicsWorld& world, const LoadOptions& options);
  struct Contents;
  std::unique_ptr<Contents> contents_;
};

/// Maps each asset once, for the parts that the plan uses: sections that no body needs are never read. Registers the
/// algorithm with the world's dispatcher, adds the bodies with their groups and masks, keeps those apart that the plan
/// has apart, and sets the gravity if the scene has one. The solver's settings are the program's: see lint.
/// The manifest may come from anywhere: it is checked, it names no file outside of its folder, and its size has limits
/// (docs/scene.md). Indices of assets are always checked, payload hashes only when asked for, as by Asset::open.
/// @pre the world's broadphase has room for the bodies: btAxisSweep3 has a limit of its own
/// @return a scene whose `error` says what is wrong with the manifest or an asset; the world is as it was then
[[nodiscard]] inline Scene load_scene(const std::string& manifest, btDiscreteDynamicsWorld& world,
                                      const LoadOptions& options = {}) {
  return Scene::load(manifest, world, options);
}
}

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file Robots of a manifest as Bullet's multibodies. Internal.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "runtime/bullet/scene/manifest.h"
#include "runtime/bullet/vps_scene.h"

namespace vps::bullet {

/// A body of the manifest, before it becomes a rigid body or a link.
struct BodyParts {
  std::string name;
  bool is_dynamic = false, is_kinematic = false;
  btCollisionShape* shape = nullptr;               ///< null: a link without collision geometry
  btTransform pose = btTransform::getIdentity();   ///< of the manifest's body, in the world
  btTransform frame = btTransform::getIdentity();  ///< of Bullet's body, in the manifest's
  btScalar mass = 0;                               ///< [kg]
  btVector3 inertia{0, 0, 0};                      ///< about the axes of `frame`. [kg m^2]
  btVector3 velocity{0, 0, 0};
  btScalar friction = btScalar(0.5), restitution = 0;
  int group = 0, mask = 0;
};

struct Joint {
  enum class Type : std::uint8_t { revolute, continuous, prismatic };
  std::string name;
  Type type{};
  std::size_t parent = 0;  ///< index of a body; kWorld: fixed to the world
  std::size_t child = 0;
  btTransform pose;                ///< of the child at the joint's zero, in the parent
  btVector3 axis{1, 0, 0};         ///< in the child, of unit length
  btScalar lower = 0, upper = -1;  ///< [rad] or [m]; no limits where lower > upper
  static constexpr std::size_t kWorld = ~std::size_t{0};
};

/// @param numbers  indices of the bodies by their names
/// @throw Refusal for joints that do not form trees
[[nodiscard]] std::vector<Joint> read_joints(const manifest::Value& list, const std::vector<BodyParts>& bodies,
                                             const std::map<std::string, std::size_t, std::less<>>& numbers);

struct Multibodies {
  std::vector<std::unique_ptr<btMultiBody>> bodies;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;
  std::vector<std::unique_ptr<btMultiBodyConstraint>> limits;
  std::map<std::size_t, btMultiBodyLinkCollider*> collider_of;  ///< by the numbers of the bodies
  std::map<std::string, JointPlace, std::less<>> joints;

  void add_to(btMultiBodyDynamicsWorld& world, const std::vector<BodyParts>& parts);
  void remove_from(btMultiBodyDynamicsWorld& world);
};

/// One multibody for each tree of joints. Nothing is added to a world.
[[nodiscard]] Multibodies make_multibodies(const std::vector<BodyParts>& bodies, const std::vector<Joint>& joints);

}  // namespace vps::bullet

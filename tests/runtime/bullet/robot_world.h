// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A Bullet world for multibodies with baked links.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "runtime/bullet/vps_bullet.h"

namespace vps::test {

/// Gravity is 9.81 m/s^2 along -z; nothing sleeps.
struct RobotWorld {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<std::unique_ptr<btMultiBody>> multibodies;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;
  std::vector<std::unique_ptr<btMultiBodyConstraint>> constraints;
  std::vector<std::unique_ptr<btTypedConstraint>> joints;  // of rigid bodies

  explicit RobotWorld(double voxel) {
    bullet::register_algorithm(dispatcher);
    world.setGravity({0, 0, btScalar(-9.81)});
    world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-2 * voxel);
  }
  RobotWorld(const RobotWorld&) = delete;
  RobotWorld& operator=(const RobotWorld&) = delete;
  ~RobotWorld() {
    for (const auto& joint : joints) world.removeConstraint(joint.get());
    for (const auto& constraint : constraints) world.removeMultiBodyConstraint(constraint.get());
    for (const auto& multibody : multibodies) world.removeMultiBody(multibody.get());
    for (const auto& collider : colliders) world.removeCollisionObject(collider.get());
    for (const auto& body : bodies) world.removeRigidBody(body.get());
  }

  /// @param mass  [kg]; 0: static
  btRigidBody& add(btCollisionShape& shape, btScalar mass, const btVector3& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(bodies.back().get());
    return *bodies.back();
  }
  /// @param mass  of the base [kg]; 0: fixed
  btMultiBody& add_multibody(int links, btScalar mass, const btVector3& inertia, const btVector3& at) {
    multibodies.push_back(std::make_unique<btMultiBody>(links, mass, inertia, mass == 0, false));
    btMultiBody& multibody = *multibodies.back();
    multibody.setBasePos(at);
    multibody.setLinearDamping(0);
    multibody.setAngularDamping(0);
    return multibody;
  }
  /// After all joints are set up.
  void finish(btMultiBody& multibody) {
    multibody.finalizeMultiDof();
    world.addMultiBody(&multibody);
  }
  /// @param link  -1: the base
  btMultiBodyLinkCollider& collide(btMultiBody& multibody, int link, btCollisionShape& shape) {
    colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&multibody, link));
    btMultiBodyLinkCollider& collider = *colliders.back();
    collider.setCollisionShape(&shape);
    collider.setActivationState(DISABLE_DEACTIVATION);
    if (link < 0) {
      multibody.setBaseCollider(&collider);
    } else {
      multibody.getLink(link).m_collider = &collider;
    }
    world.addCollisionObject(&collider, btBroadphaseProxy::DefaultFilter, btBroadphaseProxy::AllFilter);
    update(multibody);
    return collider;
  }
  /// Moves the colliders to where the joints are.
  static void update(btMultiBody& multibody) {
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    multibody.forwardKinematics(rotations, origins);
    multibody.updateCollisionObjectWorldTransforms(rotations, origins);
  }
  btMultiBodyJointMotor& drive(btMultiBody& multibody, int link, btScalar velocity, btScalar most_impulse) {
    auto motor = std::make_unique<btMultiBodyJointMotor>(&multibody, link, velocity, most_impulse);
    btMultiBodyJointMotor& kept = *motor;
    constraints.push_back(std::move(motor));
    world.addMultiBodyConstraint(&kept);
    return kept;
  }
  void step(int count, btScalar dt = btScalar(1.0 / 240)) {
    for (int i = 0; i < count; ++i) world.stepSimulation(dt, 0);
  }
};

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A stock Bullet world with the algorithm registered, and assets baked from simple shapes.
#pragma once

#include <btBulletDynamicsCommon.h>
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "runtime/bullet/vps_bullet.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::test {

inline std::shared_ptr<Asset> baked_at(const TriangleMesh& mesh, double voxel_size) {
  BakeOptions options;
  options.voxel_size = voxel_size;
  return baked(mesh, options);
}

struct World {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btRigidBody>> bodies;

  World() {
    bullet::register_algorithm(dispatcher);
    world.setGravity({0, 0, btScalar(-9.81)});
    world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-1e-5);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    for (const auto& body : bodies) world.removeRigidBody(body.get());
  }

  btRigidBody& add(btCollisionShape& shape, btScalar mass, const btVector3& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(bodies.back().get());
    return *bodies.back();
  }
  void step(int count, btScalar dt = btScalar(1.0 / 240)) {
    for (int i = 0; i < count; ++i) world.stepSimulation(dt, 0);
  }
  /// All contact points of all manifolds.
  std::vector<btManifoldPoint> points() {
    std::vector<btManifoldPoint> all;
    for (int m = 0; m < dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold->getNumContacts(); ++i) all.push_back(manifold->getContactPoint(i));
    }
    return all;
  }
};

inline double speed(const btRigidBody& body) {
  return double(body.getLinearVelocity().length()) + 0.05 * double(body.getAngularVelocity().length());
}

}  // namespace vps::test

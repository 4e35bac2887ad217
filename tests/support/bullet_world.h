// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A standard Bullet world with the algorithm registered and the narrowphase timed.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "runtime/bullet/vps_bullet.h"

namespace vps::test {

/// Times the whole narrowphase of a step: every pair, from its algorithm to its manifolds.
class TimedDispatcher final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override {
    const auto begin = std::chrono::steady_clock::now();
    btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
    last_us = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  }
  double last_us = 0;
};

/// Gravity is 9.81 m/s^2 along -z; bodies never sleep. Split impulses start at two voxels of penetration, as
/// docs/bullet.md advises.
struct World {
  btDefaultCollisionConfiguration configuration;
  TimedDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btRigidBody>> bodies;

  /// @param voxel  of worlds without baked shapes; otherwise that of the finest one counts. [m]
  explicit World(double voxel = 0.02) {
    bullet::register_algorithm(dispatcher);
    world.setGravity({0, 0, btScalar(-9.81)});
    split_from(voxel);
  }
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    for (const auto& body : bodies) world.removeRigidBody(body.get());
  }

  /// @param mass  [kg]; 0: static
  btRigidBody& add(btCollisionShape& shape, btScalar mass, const btTransform& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(mass, inertia);
    if (const auto* const baked = dynamic_cast<const bullet::Shape*>(&shape))
      split_from(baked->asset().info().voxel_size);
    bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, &shape, inertia));
    bodies.back()->setWorldTransform(at);
    bodies.back()->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(bodies.back().get());
    return *bodies.back();
  }
  btRigidBody& add(btCollisionShape& shape, btScalar mass, const btVector3& at) {
    return add(shape, mass, btTransform(btQuaternion::getIdentity(), at));
  }
  void step(int count, btScalar dt = btScalar(1.0 / 240)) {
    for (int i = 0; i < count; ++i) world.stepSimulation(dt, 0);
  }
  void split_from(double voxel) {
    btScalar& threshold = world.getSolverInfo().m_splitImpulsePenetrationThreshold;
    threshold = std::max(threshold, btScalar(-2 * voxel));
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

/// Kinetic energy. [J]
inline double kinetic_energy(const btRigidBody& body) {
  if (body.getInvMass() == 0) return 0;
  const btVector3 spin = body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
  const btVector3 inertia = body.getLocalInertia();
  return 0.5 * double(body.getLinearVelocity().length2()) / double(body.getInvMass()) +
         0.5 * double((inertia * spin).dot(spin));
}

}  // namespace vps::test

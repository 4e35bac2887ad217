// SPDX-License-Identifier: GPL-3.0-or-later
#include <btBulletDynamicsCommon.h>

#include <algorithm>

#include "cli/lab/bullet.h"
#include "cli/lab/timed_dispatcher.h"

namespace vps::lab {
namespace {

class BulletPair final : public PairPeer {
 public:
  explicit BulletPair(BulletShape shape) : shape_(std::move(shape)) {
    // Bullet skips pairs of two static objects, so neither is static.
    for (btCollisionObject* object : {&first_, &second_}) {
      object->setCollisionShape(shape_.shape.get());
      object->setCollisionFlags(0);
      object->setActivationState(DISABLE_DEACTIVATION);
      world_.addCollisionObject(object);
    }
  }
  ~BulletPair() override {
    world_.removeCollisionObject(&first_);
    world_.removeCollisionObject(&second_);
  }
  PairAnswer query(const Pose& first_in_second) override {
    // Clears the contacts of the last pose: Bullet would keep and refresh them.
    for (int m = 0; m < dispatcher_.getNumManifolds(); ++m) dispatcher_.getManifoldByIndexInternal(m)->clearManifold();
    btTransform transform;
    const double* const r = first_in_second.rotation;
    const double* const t = first_in_second.translation;
    transform.setBasis({btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]), btScalar(r[5]),
                        btScalar(r[6]), btScalar(r[7]), btScalar(r[8])});
    transform.setOrigin({btScalar(t[0]), btScalar(t[1]), btScalar(t[2])});
    first_.setWorldTransform(transform);
    dispatcher_.last_us = 0;
    world_.performDiscreteCollisionDetection();
    PairAnswer answer;
    answer.microseconds = dispatcher_.last_us;
    double deepest = -std::numeric_limits<double>::max();
    answer.contacts = dispatcher_.for_each_contact([&](const btManifoldPoint& p, const btPersistentManifold& manifold) {
      if (-double(p.getDistance()) <= deepest) return;
      deepest = -double(p.getDistance());
      // Bullet's normal points from its body B to its body A. Either of them may be the first body.
      const bool is_a = manifold.getBody0() == &first_;
      const btVector3 position = is_a ? p.getPositionWorldOnA() : p.getPositionWorldOnB();
      const btVector3 direction = is_a ? p.m_normalWorldOnB : -p.m_normalWorldOnB;
      for (int i = 0; i < 3; ++i) {
        answer.position[std::size_t(i)] = double(position[i]);
        answer.direction[std::size_t(i)] = double(direction[i]);
      }
    });
    if (answer.contacts > 0) answer.depth = deepest;
    return answer;
  }

 private:
  const BulletShape shape_;
  btDefaultCollisionConfiguration configuration_;
  TimedDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btCollisionWorld world_{&dispatcher_, &broadphase_, &configuration_};
  btCollisionObject first_, second_;
};

}  // namespace

DropResult drop(const BulletShape& body, const Ground& ground, const DropOptions& options) {
  btDefaultCollisionConfiguration configuration;
  TimedDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, btScalar(-9.81), 0});
  // Bullet's default of 4 cm lets small bodies hop out of an overlap.
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-2 * options.voxel);

  btRigidBody still(0, nullptr, ground.shape.shape.get());
  still.setWorldTransform(btTransform(btQuaternion::getIdentity(), ground.position));
  btRigidBody falling(1, nullptr, body.shape.get(), btVector3(btScalar(4.79e-3), btScalar(4.46e-3), btScalar(6.38e-3)));
  falling.setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.5 - options.lowest), 0)));
  falling.setActivationState(DISABLE_DEACTIVATION);
  world.addRigidBody(&still);
  world.addRigidBody(&falling);

  DropResult out;
  for (int step = 1; step <= options.last_timed; ++step) {
    dispatcher.last_us = 0;
    world.stepSimulation(btScalar(1.0 / 200), 0);
    if (step < options.first_timed) continue;
    out.microseconds.push_back(dispatcher.last_us);
    out.contacts.push_back(double(dispatcher.for_each_contact([](const auto&...) {})));
  }
  out.height = double(falling.getWorldTransform().getOrigin().y());
  out.speed = double(falling.getLinearVelocity().length());
  world.removeRigidBody(&falling);
  world.removeRigidBody(&still);
  return out;
}

std::unique_ptr<PairPeer> bullet_pair(const BulletShape& shape) {
  return std::make_unique<BulletPair>(shape);
}

}  // namespace vps::lab

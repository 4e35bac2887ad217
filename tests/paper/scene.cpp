// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/paper/scene.h"

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>

#include <algorithm>

#include "tests/support/random.h"

namespace vps::paper {
namespace {

double lowest_of(const btTransform& at, const std::vector<btVector3>& corners) {
  double lowest = 1e30;
  for (const btVector3& corner : corners) lowest = std::min(lowest, double((at * corner).y()));
  return lowest;
}

}  // namespace

Scene::Scene(const Floor& floor, Motion motion, const SceneOptions& options)
    : world_(options.voxel), options_(options) {
  btGImpactCollisionAlgorithm::registerAlgorithm(&world_.dispatcher);
  bullet::register_algorithm(world_.dispatcher);  // GImpact overwrites entries
  world_.world.setGravity({0, -btScalar(options.gravity), 0});
  world_.add(*floor.ground.shape.shape, 0, floor.ground.position);
  if (motion == Motion::advanced) world_.world.addAction(&continuous_);
}

btRigidBody& Scene::add(const lab::BulletShape& body, const btTransform& at, const btVector3& inertia) {
  const bool given = !inertia.isZero();
  btRigidBody& added = world_.add(*body.shape, 1, at);
  if (given) {
    added.setMassProps(1, inertia);
    added.updateInertiaTensor();
  }
  return added;
}

void Scene::set_floor_restitution(btScalar restitution) {
  world_.bodies.front()->setRestitution(restitution);
}

void Scene::step() {
  world_.dispatcher.last_us = 0;
  const auto begin = lab::Clock::now();
  world_.step(1, btScalar(1 / options_.rate));
  last_step_us_ = lab::microseconds_since(begin);
}

Drop::Drop(const Side& side, const Floor& floor, const std::vector<btVector3>& corners, const btMatrix3x3& rotation,
           const SceneOptions& options)
    : corners_(corners), scene_(floor, side.motion, options) {
  btTransform at(rotation);
  at.getOrigin().setY(btScalar(kDropHeight - lowest_of(at, corners)));
  body_ = &scene_.add(side.body, at, {btScalar(4.79e-3), btScalar(4.46e-3), btScalar(6.38e-3)});
}

double Drop::lowest() const {
  return lowest_of(body_->getWorldTransform(), corners_);
}

std::vector<btMatrix3x3> random_rotations(int count) {
  test::Random random;
  std::vector<btMatrix3x3> rotations;
  for (int i = 0; i < count; ++i) {
    const std::array<double, 9> r = random.rotation();
    rotations.emplace_back(btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]),
                           btScalar(r[5]), btScalar(r[6]), btScalar(r[7]), btScalar(r[8]));
  }
  return rotations;
}

}  // namespace vps::paper

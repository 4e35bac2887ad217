// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/growth/plays.h"

#include <fmt/format.h>
#include <malloc.h>

#include <cmath>
#include <stdexcept>

#include "tests/support/bullet_world.h"

namespace vps::bench {
namespace {

using test::World;

constexpr double kRate = 240;      // of motion with velocities. [Hz]
constexpr double kEnough = 0.3e6;  // of the narrowphase in a ride. [us]

// Moves the bodies of pairs for a step.
void move(World& world, Play play, double step, int i) {
  const bool is_back = play == Play::placed ? i % 2 != 0 : i % 8 >= 4;
  const btVector3 way(btScalar(is_back && play != Play::drifting ? -step : step), 0, 0);
  for (std::size_t b = 0; b < world.bodies.size(); b += play == Play::drifting ? 1 : 2) {
    btRigidBody& body = *world.bodies[b];
    if (play == Play::turning) {
      btVector3 centre;
      btScalar radius = 0;
      body.getCollisionShape()->getBoundingSphere(centre, radius);
      const btScalar angle = way.x() / (centre.length() + radius);
      body.getWorldTransform().setRotation(btQuaternion({0, 0, 1}, angle) * body.getWorldTransform().getRotation());
      body.setAngularVelocity({0, 0, btScalar(kRate) * angle});
      continue;
    }
    body.getWorldTransform().getOrigin() += way;
    if (play != Play::placed) body.setLinearVelocity(btScalar(kRate) * way);
  }
}

}  // namespace

Times fresh(bullet::Shape& shape, const Ground& ground, const std::vector<btTransform>& places) {
  World world;
  world.add(*ground.shape, 0, ground.at);
  btRigidBody& body = world.add(shape, 1, places[0]);
  Times us;
  for (const btTransform& place : places) {
    world.broadphase.getOverlappingPairCache()->cleanProxyFromPairs(body.getBroadphaseHandle(), &world.dispatcher);
    body.setWorldTransform(place);
    world.world.performDiscreteCollisionDetection();
    us.push_back(world.dispatcher.last_us);
  }
  us.erase(us.begin(), us.begin() + 4);  // these warm up
  return us;
}

Times ride(bullet::Shape& shape, const Ground& ground, const btTransform& start, const Ride& ride, btTransform* end) {
  World world;
  world.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  world.add(*ground.shape, 0, ground.at);
  btRigidBody& body = world.add(shape, 1, start);
  if (ride.speed > 0) {
    body.setFriction(0);
    body.setLinearVelocity({btScalar(ride.speed * voxel_of(shape) * ride.rate), 0, 0});
  }
  Times us;
  double spent = 0;
  for (int i = 0; i < ride.before + 120 && (spent < kEnough || us.size() < 5); ++i) {
    world.step(1, btScalar(1 / ride.rate));
    spent += world.dispatcher.last_us;
    if (i >= ride.before) us.push_back(world.dispatcher.last_us);
  }
  if (end != nullptr) *end = body.getWorldTransform();
  return us;
}

Times drive(bullet::Shape& shape, const Ground& ground, const std::vector<btTransform>& path) {
  constexpr auto kStep = btScalar(1 / kRate);
  World world;
  world.world.setGravity({0, 0, 0});
  world.add(*ground.shape, 0, ground.at);
  btRigidBody& body = world.add(shape, 1, path[0]);
  Times us;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    btVector3 linear, angular;
    btTransformUtil::calculateVelocity(path[i], path[i + 1], kStep, linear, angular);
    body.setWorldTransform(path[i]);
    body.setInterpolationWorldTransform(path[i]);
    body.setLinearVelocity(linear);
    body.setAngularVelocity(angular);
    world.step(1, kStep);
    if (i >= 3) us.push_back(world.dispatcher.last_us);
  }
  return us;
}

Times many_pairs(btCollisionShape& shape, const std::vector<Places>& places, int pairs, Play play, double step,
                 double* bytes) {
  World world;
  const int side = int(std::ceil(std::sqrt(pairs)));
  for (int i = 0; i < pairs; ++i) {
    const btVector3 corner(btScalar(i % side - side / 2), btScalar(i / side - side / 2), 0);
    const auto& [first, second] = places[std::size_t(i) % places.size()];
    for (const btTransform& at : {first, second}) {
      const btTransform moved(at.getBasis(), at.getOrigin() + corner);
      world.add(shape, 1, moved).setInterpolationWorldTransform(moved);  // Bullet's bounds include both
    }
  }
  world.world.updateAabbs();
  world.world.computeOverlappingPairs();
  const int found = world.broadphase.getOverlappingPairCache()->getNumOverlappingPairs();
  if (found != pairs) throw std::runtime_error(fmt::format("{} pairs instead of {}", found, pairs));
  world.world.getDispatchInfo().m_timeStep = btScalar(1 / kRate);
  const auto heap = [] { return double(mallinfo2().uordblks + mallinfo2().hblkhd); };
  const double before = heap();
  Times us;
  for (int i = 0; i < (play == Play::first ? 1 : 18); ++i) {
    if (play != Play::first && play != Play::still) move(world, play, step, i);
    world.world.performDiscreteCollisionDetection();
    if (play == Play::first || i >= 2) us.push_back(world.dispatcher.last_us / pairs);
  }
  if (bytes != nullptr) *bytes = (heap() - before) / pairs;
  return us;
}

}  // namespace vps::bench

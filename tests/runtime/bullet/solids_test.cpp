// SPDX-License-Identifier: GPL-3.0-or-later
// Bullet's own solids on baked bodies: tips between the points of a shell, hulls of many corners, bodies that a program
// moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

btVector3 at(double x, double y, double z) {
  return {static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z)};
}

TEST(Solids, TipsMeetABallBetweenItsPoints) {
  constexpr double kBall = 0.1;
  constexpr double kVoxel = 0.004;
  constexpr double kRounding = 0.001;
  bullet::Shape sphere(baked_at(make_sphere(kBall, 5), kVoxel));
  btConeShapeZ cone(btScalar(0.015), btScalar(0.1));
  btConvexHullShape spike;
  spike.addPoint(at(0, 0, 0.05), false);
  constexpr int kSides = 24;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    spike.addPoint(at(0.015 * std::cos(angle), 0.015 * std::sin(angle), -0.05), false);
  }
  spike.recalcLocalAabb();
  Random random;
  for (btConvexInternalShape* const shape :
       {static_cast<btConvexInternalShape*>(&cone), static_cast<btConvexInternalShape*>(&spike)}) {
    shape->setMargin(btScalar(kRounding));
    for (int start = 0; start < 10; ++start) {
      World scene;
      scene.add(sphere, 0, at(0, 0, 0));
      const auto off = [&] { return random.between(-0.02, 0.02); };
      const btTransform upside_down(btQuaternion(at(1, 0, 0), btScalar(std::numbers::pi)),
                                    at(off(), off(), kBall + 0.056));
      btRigidBody& body = scene.add(*shape, btScalar(0.2), upside_down);
      body.setLinearVelocity(at(0, 0, -0.3));
      double deepest = 0;
      for (int step = 0; step < 100; ++step) {
        scene.step(1, btScalar(0.001));
        const btVector3 tip = body.getWorldTransform() * at(0, 0, 0.05);
        deepest = std::max(deepest, kBall + kRounding - double(tip.length()));
      }
      EXPECT_LT(deepest, 1.5 * kVoxel) << shape->getName() << ", start " << start;
    }
  }
}

TEST(Solids, SmallSpheresOfAMultiSphereMeetASlabBetweenItsPoints) {
  constexpr double kTop = 0.04;
  constexpr double kVoxel = 0.004;
  bullet::Shape slab(baked_at(make_box({0.2, 0.2, kTop}), kVoxel));
  const btVector3 centres[] = {at(3, 3, 3), at(-3, -3, 3), at(-3, 3, -3), at(3, -3, -3)};
  const btScalar radii[] = {btScalar(0.04), btScalar(0.04), btScalar(0.2), btScalar(0.4)};
  Random random;
  for (const double scale : {0.01, 0.005}) {
    btMultiSphereShape shape(centres, radii, 4);
    shape.setLocalScaling(at(scale, scale, scale));
    for (int start = 0; start < 10; ++start) {
      World scene;
      scene.add(slab, 0, at(0, 0, 0));
      const std::array<double, 9> r = random.rotation();
      btTransform pose(btQuaternion::getIdentity(), at(0, 0, kTop + 0.08));
      for (int i = 0; i < 3; ++i) pose.getBasis()[i] = at(r[3 * i], r[3 * i + 1], r[3 * i + 2]);
      btRigidBody& body = scene.add(shape, btScalar(0.2), pose);
      body.setLinearVelocity(at(0, 0, -0.5));
      double deepest = 0;
      for (int step = 0; step < 300; ++step) {
        scene.step(1, btScalar(0.001));
        for (std::size_t i = 0; i < 4; ++i) {
          const btVector3 centre = body.getWorldTransform() * (btScalar(scale) * centres[i]);
          deepest = std::max(deepest, kTop + scale * double(radii[i]) - double(centre.z()));
        }
      }
      EXPECT_LT(deepest, 0.5 * kVoxel) << scale << ", start " << start;
    }
  }
}

TEST(Solids, HullsOfManyCornersAreNotPushedSidewaysByFlatGround) {
  bullet::Shape ground(baked_at(make_box({0.4, 0.4, 0.04}), 0.004));
  for (const int count : {17, 40, 300}) {
    for (unsigned start = 0; start < 4; ++start) {
      Random random(start);
      btConvexHullShape hull;
      for (int i = 0; i < count; ++i) {
        const std::array<double, 9> r = random.rotation();
        hull.addPoint(at(0.05 * r[0], 0.05 * r[1], 0.05 * r[2]), false);
      }
      hull.recalcLocalAabb();
      hull.setMargin(btScalar(0.001));
      World scene;
      scene.add(ground, 0, at(0, 0, 0)).setFriction(0);
      btRigidBody& body = scene.add(hull, 1, at(0, 0, 0.04 + 0.052 + 0.1));
      body.setFriction(0);
      double fastest = 0;
      for (int step = 0; step < 480; ++step) {
        scene.step(1, btScalar(1.0 / 240));
        const btVector3 velocity = body.getLinearVelocity();
        fastest = std::max(fastest, std::hypot(double(velocity.x()), double(velocity.y())));
      }
      EXPECT_LT(fastest, 0.02) << count << " corners, start " << start;
      double lowest = 1;
      for (int i = 0; i < hull.getNumPoints(); ++i) {
        lowest = std::min(lowest, double((body.getWorldTransform() * hull.getScaledPoint(i)).z()));
      }
      EXPECT_NEAR(lowest, 0.041, 0.0004);
    }
  }
}

// With all its corners on the plane of the ground it kept 0.79 of its speed.
TEST(Solids, AHullOfManyCornersRollsOverFlatBakedGround) {
  constexpr double kRadius = 0.1;
  constexpr int kSides = 256;
  btConvexHullShape hull;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    for (const double y : {-0.03, 0.03}) {
      hull.addPoint(at(kRadius * std::cos(angle), y, kRadius * std::sin(angle)), false);
    }
  }
  hull.recalcLocalAabb();
  hull.setMargin(btScalar(0.001));
  bullet::Shape slab(baked_at(make_box({1.0, 0.4, 0.1}), 0.01));
  World scene(0.001);
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  scene.add(slab, 0, at(0.7, 0, -0.1));
  btRigidBody& body = scene.add(hull, 1, at(0, 0, kRadius + 0.001));
  body.setLinearVelocity(at(1, 0, 0));
  body.setAngularVelocity(at(0, 1 / kRadius, 0));
  scene.step(360);
  EXPECT_GT(body.getLinearVelocity().x(), 0.97);
  EXPECT_NEAR(double(body.getWorldTransform().getOrigin().z()), kRadius, 0.005);
}

// Bullet marks a body without mass as static, and a program adds that it is kinematic.
TEST(Solids, ABodyThatAProgramMovesHasContactsAhead) {
  constexpr double kSpeed = 5;
  constexpr double kStep = 1.0 / 240;
  bullet::Shape brick_shape(brick());
  btBoxShape box(at(0.05, 0.05, 0.05));
  for (const bool is_box_moved : {true, false}) {
    World scene;
    scene.world.setGravity({0, 0, 0});
    btCollisionShape& moved = is_box_moved ? static_cast<btCollisionShape&>(box) : brick_shape;
    btCollisionShape& hit = is_box_moved ? static_cast<btCollisionShape&>(brick_shape) : box;
    btRigidBody& mover = scene.add(moved, 0, at(-0.13, 0, 0));
    btRigidBody& body = scene.add(hit, 1, at(0, 0, 0));
    mover.setCollisionFlags(mover.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    mover.setInterpolationWorldTransform(mover.getWorldTransform());
    double deepest = 0;
    for (int step = 1; step <= 12; ++step) {
      mover.setWorldTransform(btTransform(btQuaternion::getIdentity(), at(-0.13 + kSpeed * kStep * step, 0, 0)));
      scene.step(1, btScalar(kStep));
      for (const btManifoldPoint& point : scene.points()) deepest = std::max(deepest, -double(point.getDistance()));
    }
    EXPECT_LT(deepest, 0.012) << is_box_moved;  // without, 0.019 and 0.024
    EXPECT_GT(body.getLinearVelocity().x(), 0.9 * kSpeed);
  }
}

}  // namespace
}  // namespace vps::test

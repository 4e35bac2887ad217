// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies that roll, slide and rest on contacts between the shell's points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

TEST(BetweenSamples, ABoxOfBulletsSlidesOverABakedSlabWithoutFriction) {
  // Points of the slab ahead of the box, whose normals are up, must not stop its front face.
  const bullet::Shape slab(baked_at(make_box({1.0, 0.15, 0.05}), 0.01));
  btBoxShape box({btScalar(0.05), btScalar(0.05), btScalar(0.05)});
  World scene;
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  scene.add(const_cast<bullet::Shape&>(slab), 0, {btScalar(0.8), 0, btScalar(-0.05)}).setFriction(0);
  btRigidBody& body = scene.add(box, 1, {0, 0, btScalar(0.05)});
  body.setFriction(0);
  body.setLinearVelocity({3, 0, 0});
  scene.step(120);
  EXPECT_NEAR(body.getLinearVelocity().x(), 3, 0.01);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().y(), 0, 0.002);
}

// Contacts at the points of its shell alone leave 0.46 to 0.94 of the speed here.
TEST(BetweenSamples, ABakedBallRollsAsASphere) {
  bullet::Shape ball(baked_at(make_sphere(0.1, 5), 0.1 / 32));
  const bullet::Shape slab(baked_at(make_box({1.0, 0.15, 0.05}), 0.01));
  btBoxShape box({1, btScalar(0.15), btScalar(0.05)});
  const std::pair<btCollisionShape*, double> grounds[] = {{&box, 5}, {const_cast<bullet::Shape*>(&slab), 1}};
  for (const auto& [ground, speed] : grounds) {
    for (const int rate : {60, 240}) {
      World scene;
      scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
      scene.add(*ground, 0, {btScalar(0.8), 0, btScalar(-0.05)});
      btRigidBody& body = scene.add(ball, 1, {0, 0, btScalar(0.1)});
      body.setLinearVelocity({btScalar(speed), 0, 0});
      body.setAngularVelocity({0, btScalar(speed / 0.1), 0});
      scene.step(int(1.5 / speed * rate), btScalar(1.0 / rate));
      EXPECT_NEAR(body.getLinearVelocity().x() / speed, 1, 0.01) << rate << " Hz, " << speed << " m/s";
      EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.1, 0.002) << rate << " Hz, " << speed << " m/s";
    }
  }
}

// The tree has a level of 19 clusters: with one contact ahead for each of them the wheel keeps 0.38 of its speed.
TEST(BetweenSamples, AFastWheelDoesNotHop) {
  bullet::Shape wheel(baked_at(make_wheel(0.1, 0.03, 256), 0.001));
  btStaticPlaneShape plane({0, 0, 1}, 0);
  for (int start = 0; start < 6; ++start) {
    World scene;
    scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    scene.add(plane, 0, {0, 0, 0});
    btRigidBody& body = scene.add(wheel, 1, {0, 0, btScalar(0.1)});
    body.getWorldTransform().setRotation(btQuaternion({0, 1, 0}, btScalar(0.004 * start)));
    body.setLinearVelocity({5, 0, 0});
    body.setAngularVelocity({0, 50, 0});
    double highest = 0;
    for (int i = 0; i < 120; ++i) {
      scene.step(1, btScalar(1.0 / 60));
      highest = std::max(highest, double(body.getWorldTransform().getOrigin().z()));
    }
    EXPECT_NEAR(body.getLinearVelocity().x(), 5, 0.15) << start;
    EXPECT_LT(highest, 0.105) << start;
  }
}

// The fall of a step at 60 Hz is 2.7 to 5.4 voxels, within which contacts lie all around the lowest place. They braked
// the ball to half of its speed.
TEST(BetweenSamples, ABallThatSlipsBeginsToRollAsASphereDoes) {
  constexpr double kRadius = 0.02;
  btBoxShape box({2, 2, btScalar(0.03)});
  for (const double voxel : {0.0005, 0.001}) {
    bullet::Shape ball(baked_at(make_sphere(kRadius, 5), voxel));
    bullet::Shape slab(baked_at(make_box({0.5, 0.5, 0.03}), 0.004));
    for (btCollisionShape* const ground :
         {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(&slab)}) {
      for (const double speed : {0.2, 0.5}) {
        World scene(voxel);
        scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
        scene.add(*ground, 0, {0, 0, btScalar(-0.03)}).setFriction(btScalar(0.8));
        btRigidBody& body = scene.add(ball, btScalar(0.1), {btScalar(-0.2), 0, btScalar(kRadius)});
        body.setFriction(btScalar(0.8));
        body.setLinearVelocity({btScalar(speed), 0, 0});
        scene.step(18, btScalar(1.0 / 60));
        EXPECT_NEAR(double(body.getLinearVelocity().x()) / speed, 5.0 / 7, 0.03)
            << voxel << ' ' << speed << ' ' << ground->getName();
      }
    }
  }
}

// The farthest place of a box in a direction. [m]
double support(const btTransform& at, const btVector3& half, const btVector3& direction) {
  const btVector3 local = direction * at.getBasis();
  return double(direction.dot(at.getOrigin()) + local.absolute().dot(half));
}

// Points of the flank that were followed along straight lines threw the ball up by 0.4 to 4.7 m, the wheel by 0.9 to 6.
TEST(BetweenSamples, RoundBodiesThatTurnFarInAStepStayOnTheirGround) {
  struct Case {
    double radius, speed, rate, voxel;
    bool is_wheel;
  };
  for (const Case& c :
       {Case{0.025, 10, 60, 0.0005, false}, Case{0.025, 20, 240, 0.001, false}, Case{0.025, 40, 60, 0.001, false},
        Case{0.3, 30, 240, 0.005, true}, Case{0.3, 30, 60, 0.005, true}, Case{0.3, 15, 60, 0.005, true}}) {
    bullet::Shape shape(
        baked_at(c.is_wheel ? make_wheel(c.radius, c.radius / 3, 256) : make_sphere(c.radius, 6), c.voxel));
    btStaticPlaneShape plane({0, 0, 1}, 0);
    World scene(c.voxel);
    scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    scene.add(plane, 0, {0, 0, 0}).setFriction(btScalar(c.is_wheel ? 0.8 : 0));
    btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(c.radius)});
    body.setFriction(btScalar(c.is_wheel ? 0.8 : 0));
    body.setAngularVelocity({0, btScalar(c.speed / c.radius), 0});
    if (c.is_wheel) body.setLinearVelocity({btScalar(c.speed), 0, 0});
    double highest = 0;
    double lowest = 0;
    for (int i = 0; i < int(c.rate / 2); ++i) {
      scene.step(1, btScalar(1 / c.rate));
      const double z = double(body.getWorldTransform().getOrigin().z()) - c.radius;
      highest = std::max(highest, z);
      lowest = std::min(lowest, z);
    }
    EXPECT_LT(highest, 0.08 * c.radius) << c.radius << " m, " << c.speed << " m/s, " << c.rate << " Hz";
    EXPECT_GT(lowest, -4 * c.voxel) << c.radius << " m, " << c.speed << " m/s, " << c.rate << " Hz";
    EXPECT_GT(double(body.getAngularVelocity().y()) * c.radius / c.speed, 0.99) << c.speed << " m/s, " << c.rate;
  }
}

// Where the plane of a contact at the kerb's edge goes on, the kerb does not: they were 16 to 48 voxels deep.
TEST(BetweenSamples, RoundBodiesThatTurnFarInAStepMeetKerbs) {
  constexpr double kRadius = 0.1;
  constexpr double kVoxel = 0.004;
  bullet::Shape ball(baked_at(make_sphere(kRadius, 5), kVoxel));
  bullet::Shape wheel(baked_at(make_wheel(kRadius, 0.03, 256), kVoxel));
  btBoxShape ground({2, 1, btScalar(0.1)});
  btBoxShape kerb({btScalar(0.5), 1, btScalar(0.1)});
  for (bullet::Shape* const shape : {&ball, &wheel}) {
    for (const auto& [speed, rate] : {std::pair{2.0, 120.0}, std::pair{5.0, 240.0}}) {
      World scene(kVoxel);
      scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
      scene.add(ground, 0, {0, 0, btScalar(-0.1)}).setFriction(btScalar(0.7));
      scene.add(kerb, 0, {1, 0, btScalar(-0.06)}).setFriction(btScalar(0.7));
      btRigidBody& body = scene.add(*shape, 1, {0, 0, btScalar(kRadius)});
      body.setFriction(btScalar(0.7));
      body.setLinearVelocity({btScalar(speed), 0, 0});
      body.setAngularVelocity({0, btScalar(speed / kRadius), 0});
      double deepest = 0;
      double lowest = kRadius;
      double on_kerb = 0;
      for (int i = 0; i < int(rate / 2); ++i) {
        scene.step(1, btScalar(1 / rate));
        for (const btManifoldPoint& point : scene.points()) deepest = std::max(deepest, -double(point.getDistance()));
        const btVector3 at = body.getWorldTransform().getOrigin();
        lowest = std::min(lowest, double(at.z()));
        if (at.x() > btScalar(0.5)) on_kerb = std::max(on_kerb, double(at.z()) - kRadius);
      }
      const char* const name = shape == &ball ? "ball " : "wheel ";
      EXPECT_LT(deepest, 5 * kVoxel) << name << speed << " m/s, " << rate << " Hz";
      EXPECT_GT(lowest, kRadius - kVoxel) << name << speed << " m/s, " << rate << " Hz";
      EXPECT_GT(on_kerb, 0.03) << name << speed << " m/s, " << rate << " Hz";
    }
  }
}

// A contact ahead slides along the plane where it arrives. The plane goes on where the other body ends.
TEST(BetweenSamples, BodiesThatDoNotTouchHaveNoContactBelowTheSurface) {
  const btVector3 half(btScalar(0.03), btScalar(0.02), btScalar(0.015));
  bullet::Shape block(baked_at(make_box({0.03, 0.02, 0.015}), 0.001));
  std::size_t ahead = 0;
  double deepest = 0;
  for (int start = 0; start < 400; ++start) {
    Random random(std::uint64_t(start + 1));
    const auto vector = [&](double far) {
      const double x = random.between(-far, far);
      const double y = random.between(-far, far);
      return btVector3(btScalar(x), btScalar(y), btScalar(random.between(-far, far)));
    };
    World scene;
    scene.world.getDispatchInfo().m_timeStep = btScalar(1.0 / 60);
    const btTransform still = btTransform::getIdentity();
    scene.add(block, 0, still);
    const btVector3 between = vector(1).normalized();
    btTransform at(btQuaternion(vector(1).normalized(), btScalar(random.between(0, 3))), vector(0.02));
    const double apart = -support(at, half, -between) - support(still, half, between) - random.between(0.0005, 0.005);
    at.setOrigin(at.getOrigin() - btScalar(apart) * between);
    btRigidBody& body = scene.add(block, btScalar(0.1), at);
    body.setLinearVelocity(vector(1) - between);
    body.setAngularVelocity(vector(10));
    scene.world.performDiscreteCollisionDetection();
    for (const btManifoldPoint& point : scene.points()) {
      deepest = std::max(deepest, -double(point.getDistance()));
      ++ahead;
    }
  }
  EXPECT_GT(ahead, 400U);
  EXPECT_LE(deepest, 0.0005);
}

// A capsule meets the distance field along its axis. At the samples it kept 0.26 of its speed.
TEST(BetweenSamples, ACapsuleRollsAndSlidesOverABakedSlab) {
  bullet::Shape slab(baked_at(make_box({1.0, 0.25, 0.05}), 0.01));
  btCapsuleShapeX capsule(btScalar(0.05), btScalar(0.2));
  for (const bool rolls : {true, false}) {
    for (const int rate : {60, 240}) {
      World scene;
      scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
      scene.add(slab, 0, {btScalar(0.8), 0, btScalar(-0.05)}).setFriction(rolls ? btScalar(0.5) : 0);
      const btQuaternion across({0, 0, 1}, rolls ? SIMD_HALF_PI : 0);
      btRigidBody& body = scene.add(capsule, 1, btTransform(across, {0, btScalar(0.003), btScalar(0.05)}));
      body.setLinearVelocity({1, 0, 0});
      if (rolls) body.setAngularVelocity({0, 20, 0});
      scene.step(rate, btScalar(1.0 / rate));
      EXPECT_NEAR(body.getLinearVelocity().x(), 1, 0.001) << rate << " Hz";
      EXPECT_NEAR(body.getWorldTransform().getOrigin().y(), 0.003, 0.001) << rate << " Hz";
      EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.0005) << rate << " Hz";
    }
  }
}

// A body with a radius of 0.1 m that rolls at 1 m/s over a slab whose middle is `ahead`. [m]
btRigidBody& roll_over(bullet::Shape& slab, btScalar ahead, btCollisionShape& round, World& scene) {
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  scene.add(slab, 0, {ahead, 0, btScalar(-0.05)});
  btRigidBody& body = scene.add(round, 1, {0, 0, btScalar(0.1)});
  body.setLinearVelocity({1, 0, 0});
  body.setAngularVelocity({0, 10, 0});
  return body;
}

// Points of the slab ahead of the wheel slope, and it is round there: they are no contacts. With them it keeps 0.93.
TEST(BetweenSamples, AWheelOfBulletsRollsOverABakedSlab) {
  bullet::Shape slab(baked_at(make_box({2, 0.2, 0.05}), 0.01));
  btCylinderShape wheel({btScalar(0.1), btScalar(0.03), btScalar(0.1)});
  World scene;
  const btRigidBody& body = roll_over(slab, btScalar(1.8), wheel, scene);
  scene.step(180, btScalar(1.0 / 60));
  EXPECT_NEAR(body.getLinearVelocity().x(), 1, 0.02);
}

TEST(BetweenSamples, ACapsuleTouchesABallBetweenItsEnds) {
  bullet::Shape ball(baked_at(make_sphere(0.1, 5), 0.1 / 32));
  btCapsuleShapeX capsule(btScalar(0.05), btScalar(0.4));
  for (const double along : {0.0, 0.03, -0.11}) {
    World scene;
    scene.add(ball, 0, {0, 0, 0});
    scene.add(capsule, 1, {btScalar(along), 0, btScalar(0.149)});
    scene.world.performDiscreteCollisionDetection();
    const auto points = scene.points();
    ASSERT_EQ(points.size(), 1U) << along;
    EXPECT_NEAR(points[0].getDistance(), -0.001, 1e-4) << along;
    EXPECT_NEAR(std::abs(points[0].m_normalWorldOnB.z()), 1, 1e-3) << along;
    EXPECT_NEAR(points[0].getPositionWorldOnA().x(), 0, 0.002) << along;
  }
}

// Where a pair has moved, nothing is left of the places that its contacts had before.
TEST(BetweenSamples, ContactsAreThoseOfAPairWithoutAPast) {
  bullet::Shape ball(baked_at(make_sphere(0.1, 5), 0.1 / 32));
  btBoxShape box({1, 1, btScalar(0.05)});
  const auto at = [](double turn) {
    return btTransform(btQuaternion({0, 1, 0}, btScalar(turn)), {btScalar(0.1 * turn), 0, btScalar(0.0999)});
  };
  const auto contact_at = [](World& scene, btRigidBody& body, const btTransform& pose) {
    body.setWorldTransform(pose);
    scene.world.performDiscreteCollisionDetection();
    const auto points = scene.points();
    EXPECT_EQ(points.size(), 1U);
    return points.empty() ? btManifoldPoint() : points[0];
  };
  World scene;
  scene.add(box, 0, {0, 0, btScalar(-0.05)});
  btRigidBody& body = scene.add(ball, 1, at(0));
  for (const double turn : {0.0, 0.0001, 0.002, 0.03, 0.7}) {
    World fresh;
    fresh.add(box, 0, {0, 0, btScalar(-0.05)});
    btRigidBody& other = fresh.add(ball, 1, at(turn));
    const btManifoldPoint expected = contact_at(fresh, other, at(turn));
    const btManifoldPoint found = contact_at(scene, body, at(turn));
    EXPECT_NEAR(found.getDistance(), expected.getDistance(), 1e-5) << turn;
    EXPECT_LT(found.getPositionWorldOnA().distance(expected.getPositionWorldOnA()), 1e-4) << turn;
  }
}

// Points of the slab alone give three contacts.
TEST(BetweenSamples, CornersOfABoxTouchABakedSlabBetweenItsPoints) {
  bullet::Shape slab(baked_at(make_box({1.0, 0.15, 0.05}), 0.01));
  btBoxShape box({btScalar(0.0131), btScalar(0.0157), btScalar(0.02)});
  World scene;
  scene.add(slab, 0, {0, 0, btScalar(-0.05)});
  scene.add(box, 1, {btScalar(0.0037), btScalar(0.0021), btScalar(0.0199)});
  scene.world.performDiscreteCollisionDetection();
  const auto points = scene.points();
  ASSERT_EQ(points.size(), 4U);
  for (const btManifoldPoint& point : points) {
    EXPECT_NEAR(std::abs(point.getPositionWorldOnA().x() - btScalar(0.0037)), 0.0131, 1e-5);
    EXPECT_NEAR(std::abs(point.getPositionWorldOnA().y() - btScalar(0.0021)), 0.0157, 1e-5);
    EXPECT_NEAR(point.getDistance(), -1e-4, 2e-4);  // 0.02 voxel
  }
}

TEST(BetweenSamples, ABallOfBulletsRollsOverABakedSlabAsOverABox) {
  bullet::Shape slab(baked_at(make_box({1.0, 0.15, 0.05}), 0.01));
  btSphereShape ball(btScalar(0.1));
  for (const int rate : {60, 240}) {
    World scene;
    const btRigidBody& body = roll_over(slab, btScalar(0.8), ball, scene);
    scene.step(3 * rate / 2, btScalar(1.0 / rate));
    EXPECT_NEAR(body.getLinearVelocity().x(), 1, 0.002) << rate;
    EXPECT_NEAR(body.getWorldTransform().getOrigin().y(), 0, 0.0005) << rate;
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.1, 0.0005) << rate;
  }
}

TEST(BetweenSamples, ABallOfBulletsRestsOnSeveralPlacesOfABakedBody) {
  // In the hole of a torus, and on both walls of a groove of 120 degrees.
  bullet::Shape ring(torus());
  const double height = 0.1;
  const double half = height * std::sqrt(3.0);
  TriangleMesh groove;
  for (const double y : {-0.2, 0.2}) {
    for (const auto& [x, z] : {std::pair{-half, -0.05}, {half, -0.05}, {half, height}, {0.0, 0.0}, {-half, height}}) {
      groove.vertices.push_back({x, y, z});
    }
  }
  groove.triangles = {{0, 1, 3}, {1, 2, 3}, {0, 3, 4}, {5, 8, 6}, {6, 8, 7}, {5, 9, 8}};
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t next = (i + 1) % 5;
    groove.triangles.push_back({i, i + 5, next});
    groove.triangles.push_back({next, i + 5, next + 5});
  }
  bullet::Shape walls(baked_at(groove, 0.005));
  const auto rests_at = [](bullet::Shape& ground, double radius, double z) {
    btSphereShape ball{btScalar(radius)};
    World scene;
    scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    scene.add(ground, 0, ground.centre_of_mass());
    btRigidBody& body = scene.add(ball, 1, {0, 0, btScalar(z + 0.002)});
    scene.step(480);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), z, 0.0007);
    EXPECT_LT(speed(body), 0.02);
    EXPECT_GE(scene.points().size(), 2U);
  };
  rests_at(ring, 0.08, std::sqrt(0.11 * 0.11 - 0.1 * 0.1));
  rests_at(walls, 0.05, 0.05 / std::sin(double(SIMD_PI) / 3));
}

}  // namespace
}  // namespace vps::test

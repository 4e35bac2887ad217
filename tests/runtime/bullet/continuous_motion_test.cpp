// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

// 4 mm thick: two voxels.
std::shared_ptr<Asset> wall() {
  return baked_at(make_box({0.002, 0.2, 0.2}), 0.002);
}

struct FastScene : World {
  bullet::ContinuousMotion continuous;
  FastScene() {
    world.setGravity({0, 0, 0});
    world.addAction(&continuous);
  }
  ~FastScene() { world.removeAction(&continuous); }
};

// Throws a shape at a thin wall at x = 0.
double farthest(btCollisionShape& thrown, btCollisionShape& wall_shape, btScalar speed, btScalar spin,
                btScalar restitution) {
  FastScene scene;
  scene.add(wall_shape, 0, {0, 0, 0}).setRestitution(restitution);
  btRigidBody& body = scene.add(thrown, 1, {btScalar(-0.5), btScalar(0.01), btScalar(0.02)});
  body.setRestitution(restitution);
  body.setLinearVelocity({speed, 0, 0});
  body.setAngularVelocity({0, spin, spin});
  double x = -1;
  for (int i = 0; i < 30; ++i) {
    scene.step(1, btScalar(1.0 / 60));
    x = std::max(x, double(body.getWorldTransform().getOrigin().x()));
  }
  return x;
}

TEST(ContinuousMotion, ThinWallsStopFastBodies) {
  bullet::Shape thrown(ball());
  bullet::Shape baked_wall(wall());
  btBoxShape box({btScalar(0.002), btScalar(0.2), btScalar(0.2)});
  btConvexHullShape hull;
  for (int i = 0; i < 8; ++i) {
    hull.addPoint({btScalar(i & 1 ? 0.002 : -0.002), btScalar(i & 2 ? 0.2 : -0.2), btScalar(i & 4 ? 0.2 : -0.2)});
  }
  hull.setMargin(btScalar(0.001));
  btCylinderShapeX disc({btScalar(0.002), btScalar(0.2), btScalar(0.2)});
  btCompoundShape compound;
  compound.addChildShape(btTransform::getIdentity(), &box);
  for (btCollisionShape* const shape :
       std::initializer_list<btCollisionShape*>{&baked_wall, &box, &hull, &disc, &compound}) {
    for (const int speed : {3, 10, 30, 100}) {
      for (const int spin : {0, 50}) {
        for (const btScalar restitution : {btScalar(0), btScalar(0.5)}) {
          EXPECT_LT(farthest(thrown, *shape, btScalar(speed), btScalar(spin), restitution), -0.045)
              << shape->getName() << ' ' << speed << ' ' << spin << ' ' << restitution;
        }
      }
    }
  }
  // A Bullet sphere against the baked wall.
  btSphereShape sphere(btScalar(0.05));
  EXPECT_LT(farthest(sphere, baked_wall, 100, 0, btScalar(0.5)), -0.045);
}

TEST(ContinuousMotion, ABodyThatFliesLowIsHeldBackByWallsAlone) {
  constexpr btScalar kStep = btScalar(1.0 / 60);
  bullet::Shape cube(baked_at(make_box({0.01, 0.01, 0.01}), 0.0008));
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btBoxShape box({btScalar(0.01), btScalar(0.2), btScalar(0.2)});
  for (const btScalar speed : {btScalar(1), btScalar(20), btScalar(100)}) {
    for (const bool is_wall : {false, true}) {
      FastScene scene;
      scene.add(plane, 0, {0, 0, 0});
      if (is_wall) scene.add(box, 0, {btScalar(2), 0, 0}).setRestitution(1);
      btRigidBody& body = scene.add(cube, btScalar(0.1), {0, 0, btScalar(0.0102)});
      if (is_wall) body.setRestitution(btScalar(0.5));  // otherwise speculative contacts stop it
      body.setLinearVelocity({speed, 0, 0});
      const int steps = is_wall ? int(btScalar(2.5) / (speed * kStep)) + 2 : 18;
      double way = 0;
      for (int i = 0; i < steps; ++i) {
        scene.step(1, kStep);
        way = std::max(way, double(body.getWorldTransform().getOrigin().x()));
      }
      if (is_wall) {
        EXPECT_NEAR(way, 1.98, 0.005) << speed;
      } else {
        EXPECT_NEAR(way, 18 * double(speed * kStep), 0.001 * way) << speed;
      }
    }
  }
}

// A floor from x = -0.3 to 0.3 m with a wall of 16 mm at its end.
TriangleMesh floor_with_wall() {
  constexpr double kProfile[6][2] = {{-0.3, -0.02}, {0.316, -0.02}, {0.316, 0.5}, {0.3, 0.5}, {0.3, 0}, {-0.3, 0}};
  TriangleMesh mesh;
  for (const double y : {-0.1, 0.1}) {
    for (const auto& [x, z] : kProfile) mesh.vertices.push_back({x, y, z});
  }
  for (std::uint32_t k = 0; k < 6; ++k) {
    const std::uint32_t next = (k + 1) % 6;
    mesh.triangles.push_back({k, next + 6, next});
    mesh.triangles.push_back({k, k + 6, next + 6});
    if (k == 4 || next == 4) continue;
    mesh.triangles.push_back({4, k, next});
    mesh.triangles.push_back({10, next + 6, k + 6});
  }
  return mesh;
}

// It touches the floor, and the wall is of the same mesh.
TEST(ContinuousMotion, ABodyThatSlidesIsStoppedByAWall) {
  bullet::Shape cube(baked_at(make_box({0.004, 0.004, 0.004}), 0.0004));
  bullet::Shape ground(baked_at(floor_with_wall(), 0.002));
  for (const double speed : {20.0, 100.0}) {
    for (int start = 0; start < 5; ++start) {
      FastScene scene;
      scene.world.setGravity({0, 0, btScalar(-9.81)});
      const btVector3 centre = ground.centre_of_mass();
      btRigidBody& floor = scene.add(ground, 0, centre);
      floor.setFriction(0);
      floor.setRestitution(1);
      btRigidBody& body = scene.add(cube, btScalar(0.01), {btScalar(-0.28 + 0.05 * start), 0, btScalar(0.004)});
      body.setFriction(0);
      for (int i = 0; i < 20; ++i) scene.step(1, btScalar(1.0 / 60));  // it comes to rest
      body.setRestitution(btScalar(0.5));                              // otherwise speculative contacts stop it
      body.setLinearVelocity({btScalar(speed), 0, 0});
      double farthest = -1;
      for (int i = 0; i < 6; ++i) {
        scene.step(1, btScalar(1.0 / 60));
        farthest = std::max(farthest, double(body.getWorldTransform().getOrigin().x()));
      }
      EXPECT_NEAR(farthest, 0.296, 0.004) << speed << " m/s, start " << start;
    }
  }
}

void move(btRigidBody& body, const btVector3& to) {
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), to));
}
btRigidBody& add_kinematic(FastScene& scene, btCollisionShape& shape, const btVector3& at) {
  btRigidBody& body = scene.add(shape, 0, at);
  body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  body.setInterpolationWorldTransform(body.getWorldTransform());
  body.setFriction(btScalar(0.8));
  return body;
}

// Bullet moves a kinematic body before the step, and leads what it carries after it in the step. Seen from its new
// pose the carried one would go into it or leave it: it slipped by half of the platform's way, and fell from the grip.
TEST(ContinuousMotion, KinematicBodiesCarryOthers) {
  bullet::Shape cube(baked_at(make_box({0.02, 0.02, 0.02}), 0.001));
  btBoxShape platform({btScalar(0.5), btScalar(0.5), btScalar(0.02)});
  for (const double rate : {60.0, 240.0}) {
    FastScene scene;
    scene.world.setGravity({0, 0, btScalar(-9.81)});
    btRigidBody& carrier = add_kinematic(scene, platform, {0, 0, btScalar(-0.02)});
    btRigidBody& body = scene.add(cube, btScalar(0.1), {0, 0, btScalar(0.02)});
    body.setFriction(btScalar(0.8));
    btScalar start = 0;
    for (int i = 1; i <= int(2 * rate); ++i) {
      move(carrier, {btScalar(0.3 * i / rate), 0, btScalar(-0.02 - 0.2 * i / rate)});
      scene.step(1, btScalar(1 / rate));
      const btScalar ahead = body.getWorldTransform().getOrigin().x() - carrier.getWorldTransform().getOrigin().x();
      if (i == int(rate / 2)) start = ahead;
      if (i >= int(rate / 2)) {
        ASSERT_NEAR(ahead, start, 0.001) << rate << ' ' << i;
      }
    }
  }
  btBoxShape finger({btScalar(0.01), btScalar(0.03), btScalar(0.03)});
  for (const double rate : {60.0, 240.0}) {
    FastScene scene;
    scene.world.setGravity({0, 0, btScalar(-9.81)});
    btRigidBody* fingers[2];
    for (const int side : {0, 1})
      fingers[side] = &add_kinematic(scene, finger, {btScalar(side == 0 ? -0.029 : 0.029), 0, 0});
    btRigidBody& body = scene.add(cube, btScalar(0.1), {0, 0, 0});
    body.setFriction(btScalar(0.8));
    for (int i = 1; i <= int(1.5 * rate); ++i) {
      for (const int side : {0, 1}) {
        move(*fingers[side], {btScalar((side == 0 ? -0.029 : 0.029) + 0.2 * std::max(0.0, i / rate - 0.25)), 0, 0});
      }
      scene.step(1, btScalar(1 / rate));
    }
    EXPECT_GT(double(body.getWorldTransform().getOrigin().z()), -0.02) << rate;
  }
}

// Speculative contacts stop bodies too, except those with restitution.
TEST(ContinuousMotion, WithoutItBodiesThatBouncePass) {
  World scene;
  scene.world.setGravity({0, 0, 0});
  bullet::Shape thrown(ball());
  bullet::Shape baked_wall(wall());
  scene.add(baked_wall, 0, {0, 0, 0}).setRestitution(btScalar(0.5));
  btRigidBody& body = scene.add(thrown, 1, {btScalar(-0.75), 0, 0});
  body.setRestitution(btScalar(0.5));
  body.setLinearVelocity({30, 0, 0});
  scene.step(10, btScalar(1.0 / 60));
  EXPECT_GT(body.getWorldTransform().getOrigin().x(), 1);
}

TEST(ContinuousMotion, FastBodiesMeetWhereNeitherWas) {
  FastScene scene;
  bullet::Shape shape(ball());
  btRigidBody& left = scene.add(shape, 1, {btScalar(-0.55), 0, 0});
  btRigidBody& right = scene.add(shape, 1, {btScalar(0.55), 0, 0});
  left.setRestitution(btScalar(0.5));
  right.setRestitution(btScalar(0.5));
  left.setLinearVelocity({50, 0, 0});
  right.setLinearVelocity({-50, 0, 0});
  scene.step(1, btScalar(1.0 / 60));
  EXPECT_EQ(scene.continuous.stops(), 2U);
  EXPECT_NEAR(left.getWorldTransform().getOrigin().x(), -0.05, 0.002);
  EXPECT_NEAR(right.getWorldTransform().getOrigin().x(), 0.05, 0.002);
  scene.step(10, btScalar(1.0 / 60));
  EXPECT_LT(left.getWorldTransform().getOrigin().x(), right.getWorldTransform().getOrigin().x());
}

TEST(ContinuousMotion, ABouncingBallKeepsItsSpeedAndHardlyPenetrates) {
  FastScene scene;
  scene.world.setGravity({0, 0, -10});
  bullet::Shape shape(ball());
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)}).setRestitution(1);
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.55)});
  body.setRestitution(btScalar(0.9));
  double lowest = 1;
  double highest_after = 0;
  bool bounced = false;
  for (int i = 0; i < 150; ++i) {
    scene.step(1, btScalar(1.0 / 200));
    const double z = double(body.getWorldTransform().getOrigin().z());
    lowest = std::min(lowest, z);
    bounced = bounced || body.getLinearVelocity().z() > 1;
    if (bounced) highest_after = std::max(highest_after, z);
  }
  EXPECT_GT(lowest, 0.0494);
  EXPECT_NEAR(highest_after - 0.05, 0.81 * 0.5, 0.03);
}

TEST(ContactAlgorithm, ABodyThatLandsIsStoppedAtTheSurfaceAtAnyRate) {
  bullet::Shape brick(baked_at(make_box({0.05, 0.05, 0.05}), 0.004));
  const bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  btBoxShape box({1, 1, btScalar(0.1)});
  for (btCollisionShape* const ground :
       {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(const_cast<bullet::Shape*>(&slab))}) {
    for (const int rate : {5, 10, 30, 60, 240}) {
      World scene;
      scene.add(*ground, 0, {0, 0, btScalar(-0.1)});
      btRigidBody& body = scene.add(brick, 1, {0, 0, btScalar(0.5)});
      body.setWorldTransform(btTransform(btQuaternion({1, 1, 0}, btScalar(0.1)), {0, 0, btScalar(0.5)}));
      double lowest = 1;
      for (int i = 0; i < 3 * rate; ++i) {
        scene.step(1, btScalar(1.0 / rate));
        lowest = std::min(lowest, double(body.getWorldTransform().getOrigin().z()));
      }
      EXPECT_GT(lowest, 0.045) << rate << ' ' << ground->getName();
      EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.003) << rate << ' ' << ground->getName();
    }
  }
}

// Past a box's edge, and past each other: bodies that come near but do not collide must not be deflected.
TEST(ContactAlgorithm, BodiesThatFlyPastAreNotDeflected) {
  bullet::Shape brick(baked_at(make_box({0.05, 0.05, 0.05}), 0.004));
  const bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  btBoxShape box({btScalar(0.3), btScalar(0.3), btScalar(0.1)});
  btConvexHullShape hull;
  for (int i = 0; i < 8; ++i) {
    hull.addPoint({btScalar(i & 1 ? 0.3 : -0.3), btScalar(i & 2 ? 0.3 : -0.3), btScalar(i & 4 ? 0.1 : -0.1)});
  }
  hull.setMargin(0);
  for (btCollisionShape* const obstacle : {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(&hull),
                                           static_cast<btCollisionShape*>(const_cast<bullet::Shape*>(&slab))}) {
    for (const double speed : {1.0, 10.0, 30.0}) {
      for (int phase = 0; phase < 5; ++phase) {
        World scene;
        scene.world.setGravity({0, 0, 0});
        scene.add(*obstacle, 0, {0, 0, btScalar(-0.1)});
        const double start = -0.5 - speed / 60 * (1 + 0.2 * phase);
        btRigidBody& body = scene.add(brick, 1, {btScalar(start), 0, btScalar(0.052)});
        body.setLinearVelocity({btScalar(speed), 0, 0});
        const int steps = static_cast<int>((1 - start) / speed * 60);
        scene.step(steps, btScalar(1.0 / 60));
        EXPECT_NEAR(body.getLinearVelocity().z(), 0, 0.01 * speed) << obstacle->getName() << ' ' << speed;
        EXPECT_NEAR(body.getLinearVelocity().x(), speed, 0.01 * speed) << obstacle->getName() << ' ' << speed;
      }
    }
  }
  World scene;
  scene.world.setGravity({0, 0, 0});
  bullet::Shape shape(ball());
  btRigidBody& left = scene.add(shape, 1, {btScalar(-0.45), 0, 0});
  btRigidBody& right = scene.add(shape, 1, {btScalar(0.45), 0, btScalar(0.11)});
  left.setLinearVelocity({20, 0, 0});
  right.setLinearVelocity({-20, 0, 0});
  scene.step(10, btScalar(1.0 / 60));
  EXPECT_EQ(left.getLinearVelocity().x(), 20);
  EXPECT_EQ(right.getLinearVelocity().z(), 0);
}

TEST(ContinuousMotion, RestingAndSlidingBodiesAreLeftAlone) {
  FastScene scene;
  scene.world.setGravity({0, 0, btScalar(-9.81)});
  bullet::Shape brick(baked_at(make_box({0.05, 0.05, 0.05}), 0.004));
  btBoxShape box({3, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)}).setFriction(0);
  btRigidBody& body = scene.add(brick, 1, {btScalar(-2), 0, btScalar(0.0501)});
  scene.step(60);
  const auto before = scene.continuous.stops();
  body.setLinearVelocity({3, 0, 0});
  scene.step(240);
  EXPECT_EQ(scene.continuous.stops(), before);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().x(), 1, 0.02);
}

double energy(const btRigidBody& body) {
  return kinetic_energy(body) + 9.81 * double(body.getWorldTransform().getOrigin().z()) / double(body.getInvMass());
}

// Otherwise it keeps the velocity that it gained in the time taken back: 2.7 mm per step at 60 Hz.
TEST(ContinuousMotion, ABodyThatIsPutBackHasTheVelocityOfThatTime) {
  bullet::Shape thrown(ball());
  btBoxShape plate({1, 1, btScalar(0.5)});
  constexpr double kStep = 0.1;
  // On the way up to a ceiling, gravity only slows the body, and its velocity is left as it is.
  for (const double start : {-0.5, -2.0, 3.0}) {
    FastScene scene;
    scene.world.setGravity({0, 0, btScalar(-9.81)});
    const double side = start > 0 ? 1 : -1;
    scene.add(plate, 0, {0, 0, btScalar(0.56 * side)}).setRestitution(1);
    btRigidBody& body = scene.add(thrown, 1, {0, 0, 0});
    body.setRestitution(1);  // otherwise speculative contacts stop it
    body.setLinearVelocity({0, 0, btScalar(start)});
    scene.step(1, btScalar(kStep));
    ASSERT_EQ(scene.continuous.stops(), 1U);
    const double at_end = start - 9.81 * kStep;
    const double moved = double(body.getWorldTransform().getOrigin().z());
    EXPECT_NEAR(moved, 0.01 * side, 0.001);
    const double lived = moved / at_end;  // Bullet moves it with the velocity at the step's end
    EXPECT_NEAR(double(body.getLinearVelocity().z()), start > 0 ? at_end : start - 9.81 * lived, 1e-3);
  }
}

// If it were stopped at the surface, where the springs exert no force yet, it would gain speed every step.
TEST(ContinuousMotion, ABodyOnSpringsSinksIntoThemAndGainsNoEnergy) {
  bullet::Shape soft(ball());
  const double sink = 0.006;  // two voxels
  // The cap's volume is pi h^2 (R - h/3).
  const double volume = 3.14159 * sink * sink * (0.05 - sink / 3);
  ASSERT_EQ(soft.set_foundation({9.81 / volume, 0.02 * 9.81 / volume}), Status::ok);
  FastScene scene;
  scene.world.setGravity({0, 0, btScalar(-9.81)});
  scene.world.getSolverInfo().m_splitImpulse = 0;
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  scene.add(plane, 0, {0, 0, 0});
  btRigidBody& body = scene.add(soft, 1, {0, 0, btScalar(0.053)});
  const double first = 9.81 * 0.053;
  for (int i = 0; i < 240; ++i) {
    scene.step(1, btScalar(1.0 / 60));
    ASSERT_LT(energy(body), 1.05 * first) << i;
  }
  EXPECT_NEAR(double(body.getWorldTransform().getOrigin().z()), 0.05 - sink, 0.1 * sink);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Bad use gives one message, at the first step, and no crash.
#include <gtest/gtest.h>

#include <limits>
#include <mutex>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

std::vector<std::string> lines;

class BadUse : public testing::Test {
 protected:
  BadUse() {
    lines.clear();
    bullet::set_message_handler([](const char* line) { lines.emplace_back(line); });
  }
  ~BadUse() override { bullet::set_message_handler(nullptr); }
  static void expect_one_line(const char* part) {
    ASSERT_EQ(lines.size(), 1U);
    EXPECT_NE(lines[0].find(part), std::string::npos) << lines[0];
    EXPECT_EQ(lines[0].rfind("vps: shape 'vps:", 0), 0U) << lines[0];
    EXPECT_EQ(lines[0].find('\n'), std::string::npos);
  }
};

TEST_F(BadUse, APairThatLacksAPartSaysSoOnce) {
  World scene;
  bullet::Shape shape(brick(), bullet::Part::voxelmap);
  shape.set_name("brick");
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  scene.add(shape, 1, {0, 0, btScalar(0.045)});
  scene.step(1);
  expect_one_line("must give a pointshell");
  EXPECT_NE(lines[0].find(" brick'"), std::string::npos);
  scene.step(10);
  EXPECT_EQ(lines.size(), 1U);
}

TEST_F(BadUse, AnAssetThatIsNotOpenSaysSoAndNothingElse) {
  for (const bool is_null : {false, true}) {
    lines.clear();
    World scene;
    bullet::Shape shape(is_null ? nullptr : std::make_shared<Asset>());
    btBoxShape box({1, 1, btScalar(0.5)});
    scene.add(box, 0, {0, 0, btScalar(-0.5)});
    btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.045)});
    scene.step(2);
    expect_one_line("its asset is not open");
    EXPECT_LT(body.getWorldTransform().getOrigin().z(), 0.045);
    const std::vector<bullet::Advice> advice = bullet::lint(scene.world, btScalar(1.0 / 240));
    ASSERT_EQ(advice.size(), 1U);
    EXPECT_EQ(advice[0].setting, "Asset::open");
  }
}

TEST_F(BadUse, ADispatcherWithoutTheAlgorithmIsTold) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btRigidBody floor(0, nullptr, &box);
  btRigidBody body(1, nullptr, &shape, {1, 1, 1});
  floor.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(-0.5)}));
  world.addRigidBody(&floor);
  world.addRigidBody(&body);
  world.stepSimulation(btScalar(1.0 / 240), 0);
  expect_one_line("register_algorithm(*dispatcher) before the first step");
  world.removeRigidBody(&body);
  world.removeRigidBody(&floor);
}

// Worlds with Shapes only: without the algorithm Bullet calls nothing of this library for their pairs.
TEST_F(BadUse, OfTwoDispatchersTheOneWithoutTheAlgorithmIsTold) {
  World known;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld unknown(&dispatcher, &broadphase, &solver, &configuration);
  bullet::ContinuousMotion in_known;
  bullet::ContinuousMotion in_unknown;
  known.world.addAction(&in_known);
  unknown.addAction(&in_unknown);
  bullet::Shape shape(brick());
  shape.set_name("known");
  bullet::Shape lost(brick());
  lost.set_name("lost");
  known.add(shape, 1, {0, 0, 0});
  btRigidBody body(1, nullptr, &lost, {1, 1, 1});
  unknown.addRigidBody(&body);
  for (int i = 0; i < 3; ++i) {
    known.step(1);
    unknown.stepSimulation(btScalar(1.0 / 240), 0);
  }
  expect_one_line("register_algorithm(*dispatcher) before the first step");
  EXPECT_NE(lines[0].find(" lost'"), std::string::npos) << lines[0];
  known.world.removeAction(&in_known);
  unknown.removeRigidBody(&body);
}

TEST_F(BadUse, ABunnyOf155MetresIsTold) {
  bullet::Shape shape(baked_at(make_box({77, 60, 60}), 5));
  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  expect_one_line("is 154 m long and weighs 1 kg");
  EXPECT_NE(lines[0].find("--unit mm"), std::string::npos);
  // A ship of the same length has a plausible mass.
  lines.clear();
  bullet::Shape ship(baked_at(make_box({77, 10, 10}), 5));
  ship.calculateLocalInertia(btScalar(1e7), inertia);
  EXPECT_TRUE(lines.empty());
}

TEST_F(BadUse, ScalingIsRefusedInWords) {
  bullet::Shape shape(brick());
  shape.setLocalScaling({2, 2, 2});
  shape.setLocalScaling({1, 1, 1});
  EXPECT_TRUE(lines.empty());
  shape.setLocalScaling({2, 2, 1});
  expect_one_line("is scaled by one factor");
  EXPECT_EQ(shape.getLocalScaling(), btVector3(1, 1, 1));
}

TEST_F(BadUse, ABodyThatIsNowhereIsTold) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btRigidBody& floor = scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.05)});
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, std::numeric_limits<btScalar>::quiet_NaN()}));
  struct Nothing final : btCollisionWorld::ContactResultCallback {
    btScalar addSingleResult(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                             const btCollisionObjectWrapper*, int, int) override {
      ADD_FAILURE();
      return 0;
    }
  } nothing;
  scene.world.contactPairTest(&body, &floor, nothing);
  expect_one_line("not finite");
  body.setWorldTransform(btTransform::getIdentity());
}

TEST(Parts, EachPlaysWhatItSays) {
  bullet::set_message_handler(nullptr);
  const auto slab = baked_at(make_box({0.3, 0.3, 0.1}), 0.01);
  // The slab has more points: if both shapes are mixed, the brick gives the pointshell.
  struct Case {
    bullet::Part brick, slab;
    bool rests;
  };
  for (const Case& test : {Case{bullet::Part::mixed, bullet::Part::mixed, true},
                           Case{bullet::Part::pointshell, bullet::Part::voxelmap, true},
                           Case{bullet::Part::voxelmap, bullet::Part::pointshell, true},
                           Case{bullet::Part::voxelmap, bullet::Part::mixed, true},
                           Case{bullet::Part::pointshell, bullet::Part::pointshell, false},
                           Case{bullet::Part::voxelmap, bullet::Part::voxelmap, false}}) {
    World scene;
    bullet::Shape body_shape(brick(), test.brick);
    bullet::Shape ground_shape(slab, test.slab);
    EXPECT_EQ(body_shape.pointshell().points > 0, test.brick != bullet::Part::voxelmap);
    EXPECT_EQ(body_shape.voxelmap().field != Field::none, test.brick != bullet::Part::pointshell);
    scene.add(ground_shape, 0, {0, 0, btScalar(-0.1)});
    const btRigidBody& body = scene.add(body_shape, 1, {0, 0, btScalar(0.052)});
    scene.step(240);
    if (test.rests) {
      EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
      EXPECT_EQ(body_shape.status(), Status::ok);
    } else {
      EXPECT_LT(body.getWorldTransform().getOrigin().z(), -1);
      EXPECT_EQ(body_shape.status(), Status::missing_part);
    }
  }
}

TEST(Parts, AMarginThickensTheBody) {
  World scene;
  bullet::Shape shape(brick());
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  shape.setMargin(btScalar(0.01));
  slab.setMargin(btScalar(0.002));
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {5, 0, btScalar(-0.5)});
  scene.add(slab, 0, {0, 0, btScalar(-0.1)});
  const btRigidBody& on_box = scene.add(shape, 1, {5, 0, btScalar(0.07)});
  const btRigidBody& on_slab = scene.add(shape, 1, {0, 0, btScalar(0.07)});
  scene.step(480);
  EXPECT_NEAR(on_box.getWorldTransform().getOrigin().z(), 0.06, 5e-4);
  EXPECT_NEAR(on_slab.getWorldTransform().getOrigin().z(), 0.062, 5e-4);
  for (const btManifoldPoint& p : scene.points()) {
    EXPECT_NEAR(p.getPositionWorldOnA().z() + p.getPositionWorldOnB().z(), 2 * p.getPositionWorldOnB().z(), 1e-3);
  }
}

}  // namespace
}  // namespace vps::test

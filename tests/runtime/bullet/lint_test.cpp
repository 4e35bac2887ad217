// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tests/runtime/bullet/world.h"
#include "tests/support/poses.h"

namespace vps::test {
namespace {

constexpr btScalar kStep = btScalar(1.0 / 240);

// Two voxels of the brick. [m]
constexpr btScalar kSplitThreshold = btScalar(-0.008);

// A world with the settings that lint advises.
struct SoundWorld : World {
  SoundWorld() {
    world.getSolverInfo().m_splitImpulsePenetrationThreshold = kSplitThreshold;
    world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  }
};

// The settings that lint reports for a sound world after a change.
template <class Change>
std::string advice_after(Change change, btScalar step = kStep) {
  SoundWorld scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  scene.add(shape, 1, {0, 0, btScalar(0.05)});
  change(scene);
  std::string settings;
  for (const bullet::Advice& advice : bullet::lint(scene.world, step)) settings += advice.setting + ' ';
  return settings;
}

TEST(Lint, ASoundWorldGetsNoAdvice) {
  EXPECT_EQ(advice_after([](World&) {}), "");
  World empty;
  EXPECT_TRUE(bullet::lint(empty.world, kStep).empty());
}

TEST(Lint, SoftBodiesAreNamed) {
  struct Soft : btSphereShape {
    Soft() : btSphereShape(1) { m_shapeType = SOFTBODY_SHAPE_PROXYTYPE; }
  } soft;
  EXPECT_EQ(advice_after([&](World& scene) { scene.add(soft, 0, {0, 0, 5}); }), "btSoftBody ");
}

TEST(Lint, ABodyTooHeavyForTheSolverIsNamed) {
  bullet::Shape shape(brick());
  const double most = std::sqrt(3.0) / double{SIMD_EPSILON};
  for (const double share : {0.99, 1.01}) {
    btRigidBody* body = nullptr;
    const auto fall = [&](World& scene) {
      body = &scene.add(shape, btScalar(share * most), {btScalar(0.5), 0, btScalar(0.05)});
      scene.step(120);
      EXPECT_EQ(body->getWorldTransform().getOrigin().z() < 0, share > 1) << share;
      body->setWorldTransform(btTransform(btQuaternion::getIdentity(), {btScalar(0.5), 0, btScalar(0.05)}));
      body->setLinearVelocity({0, 0, 0});
    };
    EXPECT_EQ(advice_after(fall), share > 1 ? "setMassProps " : "") << share;
  }
}

TEST(Lint, EachSettingThatHurtsIsNamed) {
  EXPECT_EQ(advice_after(
                [](World& scene) { scene.world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-0.04); }),
            "m_splitImpulsePenetrationThreshold ");
  EXPECT_EQ(advice_after(
                [](World& scene) { scene.world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-1e-5); }),
            "m_splitImpulsePenetrationThreshold ");
  EXPECT_EQ(advice_after([](World& scene) { scene.world.getSolverInfo().m_splitImpulse = 0; }),
            "m_splitImpulsePenetrationThreshold ");
  EXPECT_EQ(advice_after([](World& scene) { scene.world.getSolverInfo().m_solverMode &= ~SOLVER_USE_WARMSTARTING; }),
            "m_solverMode ");
  EXPECT_EQ(
      advice_after([](World& scene) { scene.world.getSolverInfo().m_solverMode &= ~SOLVER_USE_2_FRICTION_DIRECTIONS; }),
      "m_solverMode ");
  EXPECT_EQ(advice_after([](World&) {}, btScalar(1.0 / 30)), "stepSimulation ");
  EXPECT_EQ(advice_after([](World& scene) { scene.bodies[1]->setLinearVelocity({20, 0, 0}); }), "ContinuousMotion ");
  EXPECT_EQ(advice_after([](World& scene) { scene.bodies[1]->forceActivationState(ACTIVE_TAG); }),
            "setSleepingThresholds ");
  const auto on_springs = [](double stiffness) {
    return [stiffness](World& scene) {
      ASSERT_EQ(static_cast<bullet::Shape*>(scene.bodies[1]->getCollisionShape())->set_foundation({stiffness, 0}),
                Status::ok);
    };
  };
  EXPECT_EQ(advice_after(on_springs(1e6)), "m_splitImpulse ");
  EXPECT_EQ(advice_after(on_springs(1e9)), "m_splitImpulse set_foundation ");
  EXPECT_EQ(advice_after([&](World& scene) {
              static_cast<bullet::Shape*>(scene.bodies[1]->getCollisionShape())->set_segments(8);
              on_springs(1e6)(scene);
            }),
            "m_splitImpulse set_segments ");
  EXPECT_EQ(advice_after([](World& scene) { scene.world.setGravity({0, 0, -9810}); }), "setGravity stepSimulation ");
  constexpr bool kSingle = std::is_same_v<btScalar, float>;
  EXPECT_EQ(advice_after([](World& scene) {
              scene.bodies[1]->setWorldTransform(btTransform(btQuaternion::getIdentity(), {10000, 0, 0}));
            }),
            kSingle ? "setWorldTransform " : "");
}

TEST(Lint, ADispatcherWithoutTheAlgorithmIsNamed) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = kSplitThreshold;
  world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  bullet::Shape shape(brick());
  btCollisionObject object;
  object.setCollisionShape(&shape);
  world.addCollisionObject(&object);
  const auto advice = bullet::lint(world, kStep);
  ASSERT_EQ(advice.size(), 1U);
  EXPECT_EQ(advice[0].setting, "register_algorithm");
  EXPECT_NE(advice[0].text.find("before the first step"), std::string::npos);
  bullet::register_algorithm(dispatcher);
  EXPECT_TRUE(bullet::lint(world, kStep).empty());
  world.removeCollisionObject(&object);
}

TEST(Lint, MarginsAndMissingPartsAreNamedWithTheirBody) {
  SoundWorld scene;
  bullet::Shape map(brick(), bullet::Part::voxelmap);
  btConvexHullShape hull;
  for (int i = 0; i < 8; ++i) hull.addPoint({btScalar(i & 1), btScalar(i & 2), btScalar(i & 4)});
  const btRigidBody& thick = scene.add(hull, 0, {0, 0, -5});
  const btRigidBody& lacking = scene.add(map, 1, {0, 0, btScalar(0.05)});
  const auto advice = bullet::lint(scene.world, kStep);
  ASSERT_EQ(advice.size(), 2U);
  EXPECT_EQ(advice[0].setting, "setMargin");
  EXPECT_EQ(advice[0].object, &thick);
  EXPECT_NE(advice[0].text.find("40 mm, 10 voxels"), std::string::npos) << advice[0].text;
  EXPECT_EQ(advice[1].setting, "Part::voxelmap");
  EXPECT_EQ(advice[1].object, &lacking);
}

TEST(Lint, ScalingIsNamedWhateverWentWrongElsewhere) {
  const auto shape_of = [](World& scene) -> bullet::Shape& {
    return *static_cast<bullet::Shape*>(scene.bodies[1]->getCollisionShape());
  };
  EXPECT_EQ(advice_after([&](World& scene) { shape_of(scene).report(Status::bad_argument); }), "");
  EXPECT_EQ(advice_after([&](World& scene) {
              shape_of(scene).setLocalScaling({2, 2, 1});
              shape_of(scene).report(Status::bad_pose);
            }),
            "setLocalScaling ");
  EXPECT_EQ(advice_after([&](World& scene) {
              shape_of(scene).setLocalScaling({2, 2, 1});
              shape_of(scene).setLocalScaling({1, 1, 1});
            }),
            "");
}

TEST(Lint, ProductsOfInertiaThatMatterAreNamed) {
  Pose turn;
  turn.rotation[0] = turn.rotation[4] = std::cos(0.4);
  turn.rotation[1] = -std::sin(0.4);
  turn.rotation[3] = std::sin(0.4);
  const auto asset = baked_at(moved(turn, make_box({0.06, 0.03, 0.03})), 0.004);
  for (const bullet::Axes axes : {bullet::Axes::of_asset, bullet::Axes::principal}) {
    SoundWorld scene;
    bullet::Shape shape(asset, bullet::Part::mixed, axes);
    scene.add(shape, 0, {0, 0, 0});
    const btRigidBody& body = scene.add(shape, 1, {0, 0, 1});
    const auto advice = bullet::lint(scene.world, kStep);
    ASSERT_EQ(advice.size(), axes == bullet::Axes::principal ? 0U : 1U);
    if (advice.empty()) continue;
    EXPECT_EQ(advice[0].setting, "Axes::of_asset");
    EXPECT_EQ(advice[0].object, &body);
    // (a^2 - b^2) sin 0.8 / 2 of a^2 + b^2
    EXPECT_NE(advice[0].text.find("0.22 of its largest"), std::string::npos) << advice[0].text;
  }
}

TEST(Lint, AVoxelmapThatCannotMeetBulletsOwnShapesNeedsNoPointshell) {
  World scene;
  bullet::Shape map(brick(), bullet::Part::voxelmap);
  bullet::Shape shell(brick(), bullet::Part::pointshell);
  btBoxShape box({1, 1, 1});
  scene.add(box, 0, {0, 0, -5});
  scene.add(map, 0, {0, 0, -4});
  scene.add(shell, 1, {0, 0, -3});
  const auto told = [&] {
    for (const auto& advice : bullet::lint(scene.world, kStep)) {
      if (advice.setting == "Part::voxelmap") return true;
    }
    return false;
  };
  EXPECT_FALSE(told());  // both are static
  scene.add(box, 1, {5, 0, 0});
  EXPECT_TRUE(told());
  scene.bodies.back()->getBroadphaseProxy()->m_collisionFilterMask = 0;
  EXPECT_FALSE(told());
}

}  // namespace
}  // namespace vps::test

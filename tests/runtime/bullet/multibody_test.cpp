// SPDX-License-Identifier: GPL-3.0-or-later
// Links of multibodies with baked shapes, beside rigid bodies with the same joints.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "runtime/bullet/body_motion.h"
#include "tests/runtime/bullet/robot_world.h"
#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

using bullet::PastMotion;
using bullet::Velocity;

btScalar drawn(std::mt19937& random, double low, double high) {
  return btScalar(std::uniform_real_distribution<double>(low, high)(random));
}
btVector3 drawn_vector(std::mt19937& random, double most) {
  btVector3 v;
  for (int axis = 0; axis < 3; ++axis) v[axis] = drawn(random, -most, most);
  return v;
}

// A free or fixed base and one link for each kind of joint, in a row.
btMultiBody& add_chain(RobotWorld& scene, bool fixed, std::mt19937& random) {
  const btVector3 inertia(btScalar(0.01), btScalar(0.02), btScalar(0.03));
  btMultiBody& chain = scene.add_multibody(5, fixed ? btScalar(0) : btScalar(2), inertia, drawn_vector(random, 1));
  const auto turned = [&] { return btQuaternion(drawn_vector(random, 1).normalized(), drawn(random, -3, 3)); };
  const auto offset = [&] { return drawn_vector(random, 0.2); };
  const auto axis = [&] { return drawn_vector(random, 1).normalized(); };
  chain.setWorldToBaseRot(turned());
  chain.setupRevolute(0, 1, inertia, -1, turned(), axis(), offset(), offset());
  chain.setupPrismatic(1, 1, inertia, 0, turned(), axis(), offset(), offset(), false);
  chain.setupFixed(2, 1, inertia, 1, turned(), offset(), offset());
  chain.setupSpherical(3, 1, inertia, 2, turned(), offset(), offset());
  chain.setupPlanar(4, 1, inertia, 3, turned(), axis(), offset());
  scene.finish(chain);
  if (!fixed) {
    chain.setBaseVel(drawn_vector(random, 2));
    chain.setBaseOmega(drawn_vector(random, 5));
  }
  btScalar speeds[8];
  for (int link = 0; link < 5; ++link) {
    for (btScalar& speed : speeds) speed = drawn(random, -5, 5);
    chain.setJointVelMultiDof(link, speeds);
  }
  return chain;
}

double angle_between(const btTransform& a, const btTransform& b) {
  const btQuaternion turn = (a.inverse() * b).getRotation();
  return 2 *
         std::asin(std::min(1.0, std::sqrt(double(turn.x() * turn.x() + turn.y() * turn.y() + turn.z() * turn.z()))));
}

TEST(Multibody, LinksMoveWithTheVelocitiesOfTheirJoints) {
  btSphereShape shape(btScalar(0.1));
  std::mt19937 random(1);
  double worst_velocity = 0;
  double worst_start = 0;
  double worst_turn = 0;
  for (int trial = 0; trial < 50; ++trial) {
    RobotWorld scene(0.001);
    btMultiBody& chain = add_chain(scene, trial % 2 == 0, random);
    for (int link = -1; link < 5; ++link) scene.collide(chain, link, shape);
    chain.stepPositionsMultiDof(btScalar(0.1));  // so that no joint is at zero
    RobotWorld::update(chain);
    std::vector<btTransform> before;
    std::vector<Velocity> velocities;
    for (const auto& collider : scene.colliders) {
      before.push_back(collider->getWorldTransform());
      velocities.push_back(bullet::velocity_of(*collider));
    }
    constexpr double kStep = 1e-3;
    chain.stepPositionsMultiDof(btScalar(kStep));
    RobotWorld::update(chain);
    for (std::size_t i = 0; i < before.size(); ++i) {
      btMultiBodyLinkCollider& collider = *scene.colliders[i];
      const PastMotion motion(collider, btScalar(kStep));
      EXPECT_EQ(motion.moves(), i > 0 || trial % 2 != 0);
      worst_start = std::max(worst_start, double((motion.at(0).getOrigin() - before[i].getOrigin()).length()));
      worst_turn = std::max(worst_turn, angle_between(motion.at(0), before[i]));
      // Of two points, by the mean of the velocities before and after the step.
      const Velocity after = bullet::velocity_of(collider);
      for (const btVector3& place : {btVector3(0, 0, 0), btVector3(btScalar(0.1), 0, 0)}) {
        const btVector3 way = collider.getWorldTransform() * place - before[i] * place;
        const btVector3 first = velocities[i].linear + velocities[i].angular.cross(before[i].getBasis() * place);
        const btVector3 last = after.linear + after.angular.cross(collider.getWorldTransform().getBasis() * place);
        worst_velocity = std::max(worst_velocity, double((way / btScalar(kStep) - (first + last) / 2).length()));
        EXPECT_LT(double(way.length()), 1.0001 * double(motion.speed()) * kStep + 1e-6);
      }
    }
  }
  EXPECT_LT(worst_velocity, 0.02);
  EXPECT_LT(worst_start, 2e-6);
  EXPECT_LT(worst_turn, 1e-3);
}

// An arm of 0.3 m on a hinge with a ball at its end swings onto a plate of two voxels that stands in its way.
struct Arm {
  double farthest = -10;  // of the arm's angle beyond the plate; 0: the ball touches the plate. [rad]
  std::uint64_t stops = 0;
};

constexpr double kReach = 0.3;

enum class Body : std::uint8_t { multibody, rigid };

Arm swing(Body body, btCollisionShape& ball, btCollisionShape& plate, double speed, double restitution, double rate,
          bool continuous) {
  RobotWorld scene(0.002);
  scene.world.setGravity({0, 0, 0});
  bullet::ContinuousMotion action;
  if (continuous) scene.world.addAction(&action);
  // The ball touches the plate where the arm points along x.
  scene.add(plate, 0, {btScalar(kReach), btScalar(0.052), 0}).setRestitution(btScalar(restitution));
  constexpr double kStart = -1.5;
  btMultiBody* multibody = nullptr;
  btRigidBody* rigid = nullptr;
  btVector3 inertia;
  ball.calculateLocalInertia(1, inertia);
  if (body == Body::multibody) {
    multibody = &scene.add_multibody(1, 0, {0, 0, 0}, {0, 0, 0});
    multibody->setupRevolute(0, 1, inertia, -1, btQuaternion::getIdentity(), {0, 0, 1}, {0, 0, 0},
                             {btScalar(kReach), 0, 0});
    scene.finish(*multibody);
    multibody->setJointPos(0, btScalar(kStart));
    multibody->setJointVel(0, btScalar(speed / kReach));
    scene.collide(*multibody, 0, ball).setRestitution(btScalar(restitution));
  } else {
    const btVector3 at(btScalar(kReach * std::cos(kStart)), btScalar(kReach * std::sin(kStart)), 0);
    rigid = &scene.add(ball, 1, at);
    rigid->setRestitution(btScalar(restitution));
    rigid->setWorldTransform(btTransform(btQuaternion({0, 0, 1}, btScalar(kStart)), at));
    rigid->setAngularVelocity({0, 0, btScalar(speed / kReach)});
    rigid->setLinearVelocity(btVector3(0, 0, btScalar(speed / kReach)).cross(at));
    scene.joints.push_back(
        std::make_unique<btHingeConstraint>(*rigid, btVector3(btScalar(-kReach), 0, 0), btVector3(0, 0, 1)));
    scene.world.addConstraint(scene.joints.back().get());
  }
  Arm arm;
  double before = kStart;
  const int steps = static_cast<int>(std::ceil(1.5 * rate * std::abs(kStart) / (speed / kReach))) + 3;
  for (int i = 0; i < steps; ++i) {
    scene.step(1, btScalar(1 / rate));
    const btVector3 at =
        (multibody != nullptr ? scene.colliders[0]->getWorldTransform() : rigid->getWorldTransform()).getOrigin();
    double angle = std::atan2(double(at.y()), double(at.x()));
    angle += 2 * SIMD_PI * std::round((before - angle) / (2 * SIMD_PI));
    before = angle;
    arm.farthest = std::max(arm.farthest, angle);
  }
  arm.stops = action.stops();
  if (continuous) scene.world.removeAction(&action);
  return arm;
}

std::shared_ptr<Asset> plate_asset() {
  return baked_at(make_box({0.2, 0.002, 0.2}), 0.002);
}

// Without contacts ahead it passes at 6 m/s and 30 Hz.
TEST(Multibody, AFastLinkIsStoppedByAThinPlate) {
  bullet::Shape thrown(ball());
  bullet::Shape baked_plate(plate_asset());
  btBoxShape box({btScalar(0.2), btScalar(0.002), btScalar(0.2)});
  for (btCollisionShape* const plate : std::initializer_list<btCollisionShape*>{&baked_plate, &box}) {
    for (const double rate : {30.0, 60.0, 240.0}) {
      for (const double speed : {1.0, 3.0, 6.0, 9.0}) {
        const double turned = speed / kReach / rate;
        if (turned > 0.7) continue;  // docs/limits.md
        for (const Body body : {Body::multibody, Body::rigid}) {
          // 2 mm, half of the plate, at the most: where it turns by 0.67 rad in a step.
          const double most = turned > 0.3 ? 0.008 : 0.002;
          EXPECT_LT(swing(body, thrown, *plate, speed, 0, rate, false).farthest, most)
              << plate->getName() << ' ' << rate << ' ' << speed << ' ' << static_cast<int>(body);
        }
      }
    }
  }
}

TEST(Multibody, ContinuousMotionStopsFastLinksThatBounce) {
  bullet::Shape thrown(ball());
  bullet::Shape baked_plate(plate_asset());
  btBoxShape box({btScalar(0.2), btScalar(0.002), btScalar(0.2)});
  for (btCollisionShape* const plate : std::initializer_list<btCollisionShape*>{&baked_plate, &box}) {
    for (const double rate : {30.0, 60.0, 240.0}) {
      for (const double speed : {1.0, 3.0, 9.0, 20.0}) {
        for (const double restitution : {0.0, 0.5}) {
          EXPECT_LT(swing(Body::multibody, thrown, *plate, speed, restitution, rate, true).farthest, 0.002)
              << plate->getName() << ' ' << rate << ' ' << speed << ' ' << restitution;
        }
      }
    }
  }
  EXPECT_GT(swing(Body::multibody, thrown, baked_plate, 20, 0.5, 30, false).farthest, 1);
}

// A base that falls freely, with a link that swings on it: they go back together.
TEST(Multibody, AFreeBaseThatIsPutBackHasTheVelocityOfThatTime) {
  bullet::Shape thrown(ball());
  btBoxShape plate({1, 1, btScalar(0.5)});
  RobotWorld scene(0.003);
  bullet::ContinuousMotion action;
  scene.world.addAction(&action);
  scene.add(plate, 0, {0, 0, btScalar(-0.56)}).setRestitution(1);
  btVector3 inertia;
  thrown.calculateLocalInertia(1, inertia);
  btMultiBody& multibody = scene.add_multibody(1, 1, inertia, {0, 0, 0});
  multibody.setupRevolute(0, 1, inertia, -1, btQuaternion::getIdentity(), {0, 1, 0}, {0, 0, btScalar(0.1)},
                          {0, 0, btScalar(0.1)});
  scene.finish(multibody);
  btCollisionObject& base = scene.collide(multibody, -1, thrown);
  base.setRestitution(1);
  const btCollisionObject& link = scene.collide(multibody, 0, thrown);
  constexpr double kStep = 0.1;
  scene.step(1, btScalar(kStep));
  scene.world.removeAction(&action);
  EXPECT_EQ(action.stops(), 1U);
  const double moved = double(base.getWorldTransform().getOrigin().z());
  EXPECT_NEAR(moved, -0.01, 0.001);
  EXPECT_NEAR(double(multibody.getBaseVel().z()), -9.81 * moved / (-9.81 * kStep), 1e-3);
  EXPECT_NEAR(double(link.getWorldTransform().getOrigin().z()), 0.2 + moved, 1e-4);
}

// As in ContinuousMotion.ABodyOnSpringsSinksIntoThemAndGainsNoEnergy.
TEST(Multibody, ALinkSinksIntoItsFoundation) {
  bullet::Shape soft(ball());
  const double sink = 0.006;
  const double volume = 3.14159 * sink * sink * (0.05 - sink / 3);
  ASSERT_EQ(soft.set_foundation({9.81 / volume, 0.05 * 9.81 / volume}), Status::ok);
  RobotWorld scene(0.003);
  scene.world.getSolverInfo().m_splitImpulse = 0;
  btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
  scene.add(plane, 0, {0, 0, 0});
  btVector3 inertia;
  soft.calculateLocalInertia(1, inertia);
  btMultiBody& multibody = scene.add_multibody(1, 0, {0, 0, 0}, {0, 0, btScalar(0.053)});
  multibody.setupPrismatic(0, 1, inertia, -1, btQuaternion::getIdentity(), {0, 0, 1}, {0, 0, 0}, {0, 0, 0}, true);
  scene.finish(multibody);
  const btCollisionObject& link = scene.collide(multibody, 0, soft);
  double lowest = 1;
  for (int i = 0; i < 480; ++i) {
    scene.step(1);
    lowest = std::min(lowest, double(link.getWorldTransform().getOrigin().z()));
  }
  EXPECT_NEAR(double(link.getWorldTransform().getOrigin().z()), 0.05 - sink, 0.1 * sink);
  EXPECT_GT(lowest, 0.05 - 2 * sink);
}

TEST(Multibody, LintLooksAtLinks) {
  bullet::Shape shape(ball());
  btBoxShape box({1, 1, btScalar(0.5)});
  RobotWorld scene(0.003);
  scene.add(box, 0, {0, 0, btScalar(-0.6)});
  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  btMultiBody& multibody = scene.add_multibody(1, 0, {0, 0, 0}, {0, 0, 0});
  multibody.setupRevolute(0, 1, inertia, -1, btQuaternion::getIdentity(), {0, 0, 1}, {0, 0, 0}, {btScalar(0.3), 0, 0});
  scene.finish(multibody);
  const btCollisionObject& link = scene.collide(multibody, 0, shape);
  const auto advice = [&] {
    std::string settings;
    for (const bullet::Advice& one : bullet::lint(scene.world, btScalar(1.0 / 240))) {
      EXPECT_TRUE(one.object == &link || one.object == nullptr);
      settings += one.setting + ' ';
    }
    return settings;
  };
  EXPECT_EQ(advice(), "");
  multibody.setJointVel(0, 60);
  EXPECT_EQ(advice(), "ContinuousMotion ");
  multibody.setJointVel(0, 0);
  ASSERT_EQ(shape.set_foundation({1e9, 0}), Status::ok);
  EXPECT_EQ(advice(), "m_splitImpulse set_foundation ");
}

}  // namespace
}  // namespace vps::test

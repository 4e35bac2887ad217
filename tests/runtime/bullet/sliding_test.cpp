// SPDX-License-Identifier: GPL-3.0-or-later
// Flat parts that slide faster than a voxel in a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

#include "tests/runtime/bullet/world.h"
#include "tests/support/poses.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

constexpr double kTop = 0.15;  // of the ground, above its middle. [m]

TEST(Sliding, AFlatPartHasFourContactsHoweverFast) {
  bullet::Shape part(brick());
  btStaticPlaneShape plane({0, 0, 1}, btScalar(kTop));
  btBoxShape box({1, 1, btScalar(kTop)});
  bullet::Shape baked(baked_at(make_box({0.7, 0.4, kTop}), 0.01));
  for (btCollisionShape* const ground : {static_cast<btCollisionShape*>(&plane), static_cast<btCollisionShape*>(&box),
                                         static_cast<btCollisionShape*>(&baked)}) {
    World scene;
    scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(part, 1, {btScalar(-0.3), 0, btScalar(kTop + 0.05)});
    body.setFriction(0);
    scene.step(24);
    body.setLinearVelocity({2, 0, 0});
    scene.step(2);
    for (int i = 0; i < 60; ++i) {
      scene.step(1);
      EXPECT_EQ(scene.points().size(), 4U) << ground->getName() << ", step " << i;
    }
    EXPECT_NEAR(body.getLinearVelocity().x(), 2, 1e-3) << ground->getName();
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), kTop + 0.05, 2e-4) << ground->getName();
    EXPECT_LT(body.getAngularVelocity().length(), 0.02) << ground->getName();
  }
}

// It falls more than a voxel in a step: as it stops, it would have many contacts once more.
TEST(Sliding, AFlatPartThatStopsKeepsItsContacts) {
  bullet::Shape part(baked_at(samples::make_gear(), 0.001));
  constexpr auto kStep = btScalar(1.0 / 90);
  btStaticPlaneShape plane({0, 0, 1}, btScalar(kTop));
  btBoxShape box({1, 1, btScalar(kTop)});
  bullet::Shape baked(baked_at(make_box({0.7, 0.4, kTop}), 0.01));
  for (btCollisionShape* const ground : {static_cast<btCollisionShape*>(&plane), static_cast<btCollisionShape*>(&box),
                                         static_cast<btCollisionShape*>(&baked)}) {
    for (const double fast : {0.9, 1.13, 1.31, 1.5}) {
      World scene;
      scene.add(*ground, 0, {0, 0, 0});
      btRigidBody& body = scene.add(part, 1, {btScalar(-0.3), 0, btScalar(kTop + 0.004)});
      body.setFriction(1);
      scene.step(20, kStep);
      body.setLinearVelocity({btScalar(fast), 0, 0});
      body.setAngularVelocity({0, 0, btScalar(fast)});
      scene.step(2, kStep);
      int moving = 0;
      for (int i = 0; i < 80; ++i) {
        scene.step(1, kStep);
        moving += body.getLinearVelocity().length() > 1e-3;
        EXPECT_EQ(scene.points().size(), 4U) << ground->getName() << ", " << fast << " m/s, step " << i;
      }
      EXPECT_GT(moving, 8);
      EXPECT_LT(moving, 60) << "it stops";
    }
  }
}

// Drops a part. @return how deep its points were in the ground at most. [m]
double depth_of_landing(bullet::Shape& part, btCollisionShape& ground, const std::array<double, 9>& rotation) {
  World scene;
  scene.add(ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(part, 1, {0, 0, btScalar(kTop + 0.1)});
  btMatrix3x3 turn;
  for (int i = 0; i < 9; ++i) turn[i / 3][i % 3] = btScalar(rotation[static_cast<std::size_t>(i)]);
  body.setWorldTransform(btTransform(turn, body.getWorldTransform().getOrigin()));
  const PointshellView shell = part.pointshell();
  double lowest = kTop;
  for (int i = 0; i < 240; ++i) {
    scene.step(1);
    const btTransform frame = body.getWorldTransform() * part.asset_frame();
    for (std::uint32_t point = 0; point < shell.points; ++point) {
      const Vec3 p = point_position(shell, point);
      lowest = std::min(lowest, double((frame * btVector3(p.x, p.y, p.z)).z()));
    }
  }
  return kTop - lowest;
}

TEST(Sliding, AFlatPartLandsOnFlatBakedGroundAsOnAPlane) {
  constexpr double kVoxel = 0.001;
  bullet::Shape part(baked_at(samples::make_gear(), kVoxel));
  btStaticPlaneShape plane({0, 0, 1}, btScalar(kTop));
  bullet::Shape baked(baked_at(make_box({0.7, 0.4, kTop}), 0.01));
  Random random(2);
  for (int start = 0; start < 6; ++start) {
    const std::array<double, 9> rotation = random.rotation();
    const double on_plane = depth_of_landing(part, plane, rotation);
    EXPECT_LT(depth_of_landing(part, baked, rotation), on_plane + 0.2 * kVoxel) << start;
  }
}

// It falls nearly three voxels in a step, so that it always has contacts ahead. Those with the samples of the ground
// would brake it.
TEST(Sliding, AFlatPartKeepsItsSpeedOnFlatBakedGroundAtLowRates) {
  constexpr auto kStep = btScalar(1.0 / 60);
  bullet::Shape part(baked_at(samples::make_gear(), 0.001));
  bullet::Shape ground(baked_at(make_box({0.7, 0.4, kTop}), 0.01));
  for (const double fast : {0.02, 0.1, 0.4}) {
    for (const double spin : {0.0, 6.0}) {
      World scene;
      scene.add(ground, 0, {0, 0, 0});
      btRigidBody& body = scene.add(part, 1, {btScalar(-0.3), 0, btScalar(kTop + 0.004)});
      body.setFriction(0);
      scene.step(12, kStep);
      body.setLinearVelocity({btScalar(fast), 0, 0});
      body.setAngularVelocity({0, 0, btScalar(spin)});
      scene.step(60, kStep);
      EXPECT_NEAR(body.getLinearVelocity().x(), fast, 1e-3 * fast) << spin << " rad/s";
      EXPECT_NEAR(body.getAngularVelocity().z(), spin, 1e-3 * spin + 1e-4) << fast << " m/s";
    }
  }
}

// Samples of oblique ground are rounded, each by up to a fiftieth of a voxel. On such bumps a slow part is as fast as
// they are high.
TEST(Sliding, AFlatPartKeepsItsSpeedOnObliqueBakedGround) {
  const Pose oblique = turned_about_two_axes();
  bullet::Shape part(baked_at(samples::make_gear(), 0.001));
  bullet::Shape ground(baked_at(moved(oblique, make_box({0.5, 0.15, 0.05})), 0.005));
  const btTransform frame = ground.asset_frame();
  for (const double rate : {60.0, 240.0, 1000.0}) {
    for (const double fast : {0.1, 0.4}) {
      World scene;
      btMatrix3x3 back;
      for (int i = 0; i < 9; ++i) back[i / 3][i % 3] = btScalar(oblique.rotation[3 * (i % 3) + i / 3]);
      scene.add(ground, 0, btTransform(back, {0, 0, btScalar(kTop - 0.05)}) * frame.inverse());
      btRigidBody& body = scene.add(part, 1, {btScalar(-0.3), 0, btScalar(kTop + 0.004)});
      body.setFriction(0);
      const auto step = btScalar(1 / rate);
      scene.step(int(0.2 * rate), step);
      body.setLinearVelocity({btScalar(fast), 0, 0});
      scene.step(int(rate), step);
      EXPECT_NEAR(body.getLinearVelocity().x(), fast, 0.05 * fast) << rate << " Hz";
      EXPECT_NEAR(body.getLinearVelocity().y(), 0, 0.05 * fast) << rate << " Hz";
    }
  }
}

// Plates side by side. @param step  of the height of each second one. [m]
TriangleMesh plates(double step) {
  constexpr double kPitch = 0.25;
  constexpr double kSlot = 0.012;
  TriangleMesh mesh;
  for (int i = 0; i < 5; ++i) {
    const double rise = i % 2 != 0 ? step : 0;
    const TriangleMesh plate = make_box({(kPitch - kSlot) / 2, 0.15, 0.05 + rise / 2}, {kPitch * (i - 2), 0, rise / 2});
    mesh = i == 0 ? plate : joined(mesh, plate);
  }
  return mesh;
}

// The level slab and the oblique one, in the world.
void add_plates(World& scene, bullet::Shape& ground, const Pose& turn) {
  btMatrix3x3 back;
  for (int i = 0; i < 9; ++i) back[i / 3][i % 3] = btScalar(turn.rotation[3 * (i % 3) + i / 3]);
  scene.add(ground, 0, btTransform(back, {0, 0, btScalar(kTop - 0.05)}) * ground.asset_frame().inverse())
      .setFriction(0);
}

// Eight corners.
btConvexHullShape make_prism(double half_height) {
  btConvexHullShape hull;
  for (const double z : {-half_height, half_height}) {
    for (const auto& [x, y] : {std::pair{-0.03, -0.02}, {0.03, -0.02}, {0.015, 0.02}, {-0.015, 0.02}}) {
      hull.addPoint({btScalar(x), btScalar(y), btScalar(z)});
    }
  }
  hull.setMargin(btScalar(0.001));
  return hull;
}

TEST(Sliding, AFlatPartSlidesOverSlots) {
  bullet::Shape gear(baked_at(samples::make_gear(), 0.001));
  bullet::Shape plate(baked_at(make_box({0.02, 0.015, 0.004}), 0.001));
  btBoxShape box({btScalar(0.02), btScalar(0.015), btScalar(0.004)});
  btCylinderShapeZ disc({btScalar(0.02), btScalar(0.02), btScalar(0.004)});
  btConvexHullShape prism = make_prism(0.003);
  for (const Pose& turn : {Pose(), turned_about_two_axes()}) {
    bullet::Shape ground(baked_at(moved(turn, plates(0)), 0.005));
    for (btCollisionShape* const part : std::initializer_list<btCollisionShape*>{&gear, &plate, &box, &disc, &prism}) {
      for (const double rate : {60.0, 240.0, 1000.0}) {
        for (const double fast : {0.3, 0.9}) {
          World scene;
          add_plates(scene, ground, turn);
          btRigidBody& body = scene.add(*part, 1, {btScalar(-0.5), btScalar(0.013), btScalar(kTop + 0.004)});
          body.setFriction(0);
          body.setLinearVelocity({btScalar(fast), 0, 0});
          scene.step(int(0.9 / fast * rate), btScalar(1 / rate));
          EXPECT_NEAR(body.getLinearVelocity().x(), fast, 0.03 * fast) << part->getName() << ", " << rate << " Hz";
          EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), kTop + 0.004, 0.0015) << part->getName();
        }
      }
    }
  }
}

// As thick by its margin as a fifth of a voxel.
TEST(Sliding, ABoxSlidesOverSlotsOfGroundWithAMargin) {
  constexpr double kThick = 0.001;
  bullet::Shape ground(baked_at(plates(0), 0.005));
  ground.setMargin(btScalar(kThick));
  btBoxShape box({btScalar(0.02), btScalar(0.015), btScalar(0.004)});
  World scene;
  add_plates(scene, ground, {});
  btRigidBody& body = scene.add(box, 1, {btScalar(-0.5), btScalar(0.013), btScalar(kTop + kThick + 0.004)});
  body.setFriction(0);
  body.setLinearVelocity({btScalar(0.5), 0, 0});
  scene.step(400);
  EXPECT_NEAR(body.getLinearVelocity().x(), 0.5, 0.01);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), kTop + kThick + 0.004, 5e-4);
}

// Its mass is far to one side: it tips about the end of the ground, not about a place that was looked up.
TEST(Sliding, ALoadedBoxRestsUpToTheEndOfTheGround) {
  bullet::Shape ground(baked_at(plates(0), 0.005));
  constexpr double kEnd = 0.619;  // of the last plate
  btBoxShape box({btScalar(0.05), btScalar(0.04), btScalar(0.01)});
  for (const double over : {0.03, 0.02, 0.01}) {
    for (const double before : {0.008, -0.004}) {
      const double middle = 0.05 - over - before;  // of the mass, from that of the box
      btCompoundShape loaded;
      loaded.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-middle), 0, 0}), &box);
      World scene;
      scene.add(
          ground, 0,
          btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(kTop - 0.05)}) * ground.asset_frame().inverse());
      btRigidBody& body = scene.add(loaded, 1, {btScalar(kEnd - before), btScalar(0.013), btScalar(kTop + 0.01)});
      scene.step(480);
      const double up = double(body.getWorldTransform().getBasis().getColumn(2).z());
      if (before > 0) {
        EXPECT_LT(speed(body), 2e-3) << over;
        EXPECT_NEAR(up, 1, 1e-4) << over;
      } else {
        EXPECT_LT(up, 0.9) << over;
      }
    }
  }
}

TEST(Sliding, AStepStopsAFlatPart) {
  bullet::Shape part(baked_at(make_box({0.02, 0.015, 0.004}), 0.001));
  btBoxShape box({btScalar(0.02), btScalar(0.015), btScalar(0.004)});
  for (const Pose& turn : {Pose(), turned_about_two_axes()}) {
    bullet::Shape ground(baked_at(moved(turn, plates(0.003)), 0.005));
    for (btCollisionShape* const shape : std::initializer_list<btCollisionShape*>{&part, &box}) {
      for (const double fast : {0.3, 0.9}) {
        World scene;
        add_plates(scene, ground, turn);
        btRigidBody& body = scene.add(*shape, 1, {btScalar(-0.5), 0, btScalar(kTop + 0.004)});
        body.setFriction(0);
        body.setLinearVelocity({btScalar(fast), 0, 0});
        scene.step(int(0.4 / fast * 240));
        EXPECT_LT(body.getLinearVelocity().x(), 0.5 * fast) << shape->getName();
      }
    }
  }
}

TEST(Sliding, AFlatPartFallsThroughAHole) {
  bullet::Shape part(baked_at(make_box({0.02, 0.015, 0.004}), 0.001));
  btBoxShape box({btScalar(0.02), btScalar(0.015), btScalar(0.004)});
  const TriangleMesh left = make_box({0.25, 0.15, 0.05}, {-0.3, 0, 0});
  bullet::Shape ground(baked_at(joined(left, make_box({0.25, 0.15, 0.05}, {0.3, 0, 0})), 0.005));
  for (btCollisionShape* const shape : std::initializer_list<btCollisionShape*>{&part, &box}) {
    World scene;
    add_plates(scene, ground, {});
    btRigidBody& body = scene.add(*shape, 1, {btScalar(-0.2), 0, btScalar(kTop + 0.004)});
    body.setFriction(0);
    body.setLinearVelocity({btScalar(0.2), 0, 0});
    scene.step(480);
    EXPECT_LT(body.getWorldTransform().getOrigin().z(), kTop - 0.1) << shape->getName();
  }
}

// At 85 m/s the wall is farther ahead than the region that is known to be flat, until the last step.
TEST(Sliding, AWallAheadStopsAFlatPart) {
  bullet::Shape part(brick());
  const TriangleMesh wall = make_box({0.05, 0.4, 0.1}, {0.5, 0, 0.2});
  bullet::Shape ground(baked_at(joined(make_box({0.7, 0.4, kTop}), wall), 0.01));
  for (const double fast : {1.0, 3.0, 10.0, 85.0}) {
    World scene;
    scene.add(ground, 0, ground.asset_frame().inverse());
    btRigidBody& body = scene.add(part, 1, {btScalar(-0.3), 0, btScalar(kTop + 0.05)});
    body.setFriction(0);
    scene.step(24);
    body.setLinearVelocity({btScalar(fast), 0, 0});
    double farthest = -1;
    for (int i = 0; i < 240; ++i) {
      scene.step(1);
      farthest = std::max(farthest, double(body.getWorldTransform().getOrigin().x()));
    }
    EXPECT_NEAR(farthest, 0.4, 0.001) << fast << " m/s";
  }
}

}  // namespace
}  // namespace vps::test

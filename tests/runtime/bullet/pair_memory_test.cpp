// SPDX-License-Identifier: GPL-3.0-or-later
// What a pair remembers from step to step does not change its contacts: beside pairs without memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/runtime/bullet/mesh_ground.h"

namespace vps::test {
namespace {

struct Touch {
  double deepest = 0;             // [m]
  btScalar least = 1, most = -1;  // x of its contacts. [m]
};
Touch touch_now(World& scene) {
  scene.world.performDiscreteCollisionDetection();
  Touch touch;
  for (const btManifoldPoint& p : scene.points()) {
    touch.deepest = std::max(touch.deepest, -double(p.getDistance()));
    touch.least = std::min(touch.least, p.getPositionWorldOnA().x());
    touch.most = std::max(touch.most, p.getPositionWorldOnA().x());
  }
  return touch;
}

// Whether a pair without memory has contacts.
bool touches_fresh(btCollisionShape& ground, btScalar top, bullet::Shape& shape, const btTransform& at) {
  World fresh;
  fresh.add(ground, 0, {0, 0, top});
  fresh.add(shape, 1, at);
  fresh.world.performDiscreteCollisionDetection();
  return !fresh.points().empty();
}

// While a pair stands still, only the points chosen before are looked at. When it moves, the others must be found.
TEST(PairMemory, ABodyThatTipsHasTheContactsOfAFreshOne) {
  const double voxel = brick()->info().voxel_size;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  Ground triangles(Kind::bvh, 0.3, 16);
  const std::pair<btCollisionShape*, btScalar> grounds[] = {
      {&box, btScalar(-0.5)}, {&slab, btScalar(-0.1)}, {&*triangles, btScalar(0)}};
  for (const double step_vx : {0.004, 0.02, 0.1}) {
    for (const auto& [ground, top] : grounds) {
      World remembers;
      remembers.add(*ground, 0, {0, 0, top});
      btRigidBody& body = remembers.add(shape, 1, {0, 0, 0});
      // From one edge of its lower face over the whole face to the other edge.
      for (double side_vx = -0.3; side_vx < 0.3; side_vx += step_vx) {
        const double sine = side_vx * voxel / 0.05;
        const double height = 0.05 + std::abs(sine) * 0.05 - 0.02 * voxel;
        const btTransform at(btQuaternion(btVector3(0, 1, 0), btScalar(sine)), {0, 0, btScalar(height)});
        body.setWorldTransform(at);
        const Touch now = touch_now(remembers);
        World fresh;
        fresh.add(*ground, 0, {0, 0, top});
        fresh.add(shape, 1, at);
        const Touch expected = touch_now(fresh);
        ASSERT_NEAR(now.deepest, expected.deepest, 0.01 * voxel) << side_vx;
        if (std::abs(side_vx) > 0.006) continue;  // not flat
        EXPECT_LT(now.least, -0.04) << side_vx;
        EXPECT_GT(now.most, 0.04) << side_vx;
      }
    }
  }
}

// The boxes of a ball and a body overlap near an edge long before the two meet.
TEST(PairMemory, APairHasContactsWhenItIsNearAndNoneWhenItIsApart) {
  bullet::Shape shape(ball());
  btBoxShape box({1, 1, 1});
  World scene;
  scene.add(box, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, 0});
  const auto contacts_at = [&](double beyond, btScalar speed) {
    const auto at = btScalar(1 + beyond / std::sqrt(2.0));
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {at, at, 0}));
    body.setLinearVelocity(btVector3(-speed, -speed, 0));
    scene.world.performDiscreteCollisionDetection();
    return scene.points().size();
  };
  const double radius = 0.05;
  scene.world.getDispatchInfo().m_timeStep = btScalar(1.0 / 240);
  for (int i = 0; i < 3; ++i) {
    EXPECT_GT(contacts_at(radius - 0.003, 0), 0U);
    EXPECT_EQ(contacts_at(radius + 0.01, 0), 0U);
    EXPECT_GT(scene.dispatcher.getNumManifolds(), 0) << "the boxes overlap";
    EXPECT_GT(contacts_at(radius + 0.01, 5), 0U) << "met in the step";
    EXPECT_EQ(contacts_at(radius + 0.01, -5), 0U) << "moves away";
  }
}

// While a pair is apart, a proven distance answers until the bodies may have come that near.
TEST(PairMemory, APairThatComesNearHasTheContactsOfAFreshOne) {
  const double voxel = brick()->info().voxel_size;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btSphereShape round(btScalar(0.5));
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  const std::pair<btCollisionShape*, btScalar> grounds[] = {
      {&box, btScalar(-0.5)}, {&round, btScalar(-0.5)}, {&slab, btScalar(-0.1)}};
  const btQuaternion turns[] = {btQuaternion::getIdentity(),
                                btQuaternion(btVector3(1, 1, 0).normalized(), btScalar(0.9))};
  for (const auto& [ground, top] : grounds) {
    for (const btQuaternion& turn : turns) {
      for (const double step_vx : {0.02, 0.3, 1.7}) {
        World remembers;
        remembers.add(*ground, 0, {0, 0, top});
        btRigidBody& body = remembers.add(shape, 1, {0, 0, 1});
        int touching = 0;
        int apart = 0;
        for (double fall_vx = 0; fall_vx < 14; fall_vx += step_vx) {
          const btTransform at(turn, {0, 0, btScalar((turn.getAngle() > 0 ? 0.0855 : 0.05) + (10 - fall_vx) * voxel)});
          body.setWorldTransform(at);
          remembers.world.performDiscreteCollisionDetection();
          const bool touches = !remembers.points().empty();
          ASSERT_EQ(touches, touches_fresh(*ground, top, shape, at)) << fall_vx << " of " << step_vx;
          (touches ? touching : apart) += 1;
        }
        EXPECT_GT(apart, 2);
        EXPECT_GT(touching, 0);
      }
    }
  }
}

// A pair that had no contact is not searched while it stands still.
TEST(PairMemory, ABodyThatComesNearSlowlyTouchesAHundredthOfAVoxelLateAtMost) {
  constexpr double kStep_vx = 0.004;
  const double voxel = brick()->info().voxel_size;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  const std::pair<btCollisionShape*, btScalar> grounds[] = {{&box, btScalar(-0.5)}, {&slab, btScalar(-0.1)}};
  for (const auto& [ground, top] : grounds) {
    World remembers;
    remembers.add(*ground, 0, {0, 0, top});
    btRigidBody& body = remembers.add(shape, 1, {0, 0, 1});
    double first_vx = 0;  // where a fresh pair touches
    double found_vx = 0;  // where the pair does
    for (double above_vx = 1; found_vx == 0 && above_vx > -1; above_vx -= kStep_vx) {
      const btTransform at(btQuaternion::getIdentity(), {0, 0, btScalar(0.05 + above_vx * voxel)});
      body.setWorldTransform(at);
      remembers.world.performDiscreteCollisionDetection();
      if (first_vx == 0 && touches_fresh(*ground, top, shape, at)) first_vx = above_vx;
      if (!remembers.points().empty()) found_vx = above_vx;
    }
    EXPECT_NE(found_vx, 0);
    EXPECT_LE(first_vx - found_vx, 0.01 + kStep_vx);
  }
}

// A manifold that was given back may belong to another pair.
TEST(PairMemory, APairThatWasRefusedLeavesTheManifoldsOfOthersAlone) {
  bullet::Shape shape(ball());
  btBoxShape box({1, 1, 1});
  const auto place = [](double beyond, double z) {
    const auto at = btScalar(1 + beyond / std::sqrt(2.0));
    return btTransform(btQuaternion::getIdentity(), {at, at, btScalar(z)});
  };
  for (const bool is_first : {false, true}) {
    World scene;
    scene.add(box, 0, {0, 0, 0});
    btRigidBody& one = scene.add(shape, 1, place(0.047, 0));
    btRigidBody& two = scene.add(shape, 1, place(1, 0.5));
    btRigidBody& refused = is_first ? one : two;
    btRigidBody& other = is_first ? two : one;
    other.setWorldTransform(place(1, 0.5));
    refused.setWorldTransform(place(0.047, 0));
    EXPECT_GT(touch_now(scene).deepest, 0);
    btTransform bad = place(0.047, 0);
    bad.getBasis() = bad.getBasis().scaled({2, 2, 2});
    refused.setWorldTransform(bad);
    scene.world.performDiscreteCollisionDetection();
    EXPECT_TRUE(scene.points().empty());
    other.setWorldTransform(place(0.047, 0.5));
    scene.world.performDiscreteCollisionDetection();
    EXPECT_FALSE(scene.points().empty());
    refused.setWorldTransform(place(0.065, 0));
    scene.world.performDiscreteCollisionDetection();
    EXPECT_FALSE(scene.points().empty()) << is_first;
  }
}

TEST(PairMemory, AMarginOrAScalingCountsAtOnceForAPairThatIsApart) {
  for (const bool thicker : {false, true}) {
    bullet::Shape shape(brick());
    btBoxShape box({1, 1, btScalar(0.5)});
    World scene;
    scene.add(box, 0, {0, 0, btScalar(-0.5)});
    btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.0495)});
    EXPECT_GT(touch_now(scene).deepest, 0);
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.15)}));
    for (int i = 0; i < 3; ++i) scene.world.performDiscreteCollisionDetection();
    EXPECT_TRUE(scene.points().empty());
    if (thicker) {
      shape.setMargin(btScalar(0.101));
    } else {
      box.setLocalScaling({1, 1, btScalar(1.202)});
    }
    EXPECT_GT(touch_now(scene).deepest, 0) << thicker;
  }
}

}  // namespace
}  // namespace vps::test

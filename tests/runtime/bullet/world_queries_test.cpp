// SPDX-License-Identifier: GPL-3.0-or-later
// Uses of shapes by Bullet besides contacts: rays, sweeps, drawing, characters.
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletDynamics/Character/btKinematicCharacterController.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

// Radii of 100 and 30 mm, about the z axis.
std::shared_ptr<Asset> fine_torus() {
  return baked_at(make_torus(0.1, 0.03, 96, 48), 0.004);
}

double distance_to_torus(const btVector3& p) {
  return std::hypot(std::hypot(double(p.x()), double(p.y())) - 0.1, double(p.z())) - 0.03;
}

// Fraction of the way at which a ray enters the torus, found in small steps; 1: it misses.
double first_inside(const btVector3& from, const btVector3& to) {
  for (int i = 0; i <= 20000; ++i) {
    if (distance_to_torus(from + (to - from) * btScalar(i / 20000.0)) <= 0) return i / 20000.0;
  }
  return 1;
}

TEST(Rays, HitWhereTheSurfaceIsAndNowhereElse) {
  World scene;
  bullet::Shape shape(fine_torus());
  scene.add(shape, 0, btVector3(0, 0, 0));
  Random random;
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const auto somewhere = [&](double size) {
      return btVector3(btScalar(random.between(-size, size)), btScalar(random.between(-size, size)),
                       btScalar(random.between(-size, size)));
    };
    const btVector3 towards = somewhere(0.12);
    const btVector3 from = somewhere(1).normalized();
    const btVector3 to = towards + (towards - from);
    btCollisionWorld::ClosestRayResultCallback ray(from, to);
    scene.world.rayTest(from, to, ray);
    const double expected = first_inside(from, to);
    const double length = double((to - from).length());
    if (expected == 1) {
      // A ray that just misses the torus may hit, within the error of the mesh's faces and of the field.
      if (ray.hasHit()) {
        EXPECT_LT(distance_to_torus(ray.m_hitPointWorld), 4e-4) << i;
      }
      continue;
    }
    const btVector3 place = from + (to - from) * btScalar(expected);
    const btVector3 axis = btVector3(place.x(), place.y(), 0).normalized() * btScalar(0.1);
    const btVector3 normal = (place - axis).normalized();
    const double slope = -double(normal.dot((to - from).normalized()));
    if (slope < 0.1) continue;  // grazing: depth does not bound the distance along the ray
    ++hits;
    ASSERT_TRUE(ray.hasHit()) << i;
    EXPECT_NEAR(double(ray.m_closestHitFraction) * length, expected * length, 4e-4 / slope) << i;
    EXPECT_GT(ray.m_hitNormalWorld.dot(normal), 0.98) << i;
  }
  EXPECT_GT(hits, 50);
}

TEST(Rays, FromAKilometreAwayAndFromInside) {
  World scene;
  bullet::Shape shape(fine_torus());
  scene.add(shape, 0, btVector3(0, 0, 0));
  const btVector3 to(btScalar(0.1), 0, 0);
  btCollisionWorld::ClosestRayResultCallback far({btScalar(0.1), 0, 1000}, to);
  scene.world.rayTest(far.m_rayFromWorld, to, far);
  ASSERT_TRUE(far.hasHit());
  EXPECT_NEAR(1000 * double(1 - far.m_closestHitFraction), 0.03, 5e-4);
  btCollisionWorld::ClosestRayResultCallback inside(to, {1, 0, 0});
  scene.world.rayTest(to, inside.m_rayToWorld, inside);
  ASSERT_TRUE(inside.hasHit());
  EXPECT_EQ(inside.m_closestHitFraction, 0);
}

TEST(Rays, APointshellAloneIsHitByItsSurfels) {
  World scene;
  bullet::Shape shape(fine_torus(), bullet::Part::pointshell);
  scene.add(shape, 0, btVector3(0, 0, 1));
  for (int i = 0; i < 200; ++i) {
    const double angle = i * 0.7;
    const btVector3 from(btScalar(0.1 * std::cos(angle)), btScalar(0.1 * std::sin(angle)), 2);
    const btVector3 to = from - btVector3(0, 0, 2);
    btCollisionWorld::ClosestRayResultCallback hit(from, to);
    scene.world.rayTest(from, to, hit);
    ASSERT_TRUE(hit.hasHit()) << i;
    EXPECT_NEAR(hit.m_hitPointWorld.z(), 1.03, 0.004);
    EXPECT_GT(hit.m_hitNormalWorld.z(), 0.8);
  }
}

// Collects the reported contacts, with their places on the first body.
struct Reported : btCollisionWorld::ContactResultCallback {
  std::vector<std::pair<btVector3, double>> contacts;
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper*, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    contacts.emplace_back(point.getPositionWorldOnA(), double(point.getDistance()));
    return 0;
  }
};

TEST(PairTests, ReportNoPhantomsAtAnyDistance) {
  World scene;
  bullet::Shape torus_shape(fine_torus());
  bullet::Shape ball_shape(ball());
  scene.add(torus_shape, 0, btVector3(0, 0, 0));
  btRigidBody& body = scene.add(ball_shape, 1, btVector3(1, 0, 0));
  const double reach = fine_torus()->info().far_range;
  Random random;
  int found = 0;
  for (int i = 0; i < 400; ++i) {
    const btVector3 at(btScalar(random.between(-0.3, 0.3)), btScalar(random.between(-0.3, 0.3)),
                       btScalar(random.between(-0.2, 0.2)));
    const double gap = distance_to_torus(at) - 0.05;
    if (gap < 0.001) continue;
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    Reported report;
    report.m_closestDistanceThreshold = btScalar(std::pow(10, random.between(-4, 0)));
    const double threshold = double(report.m_closestDistanceThreshold);
    scene.world.contactPairTest(&body, scene.world.getCollisionObjectArray()[0], report);
    constexpr double kTolerance = 0.002;  // half a voxel
    for (const auto& [place, distance] : report.contacts) {
      EXPECT_GT(distance, gap - kTolerance) << i;
      EXPECT_NEAR(distance_to_torus(place), distance, 2 * kTolerance) << i;
      EXPECT_LT(gap, std::min(std::max(threshold, 0.0004), reach) + kTolerance) << i;
    }
    found += report.contacts.empty() ? 0 : 1;
  }
  EXPECT_GT(found, 20);
}

TEST(Sweeps, AConvexShapeStopsWithinAVoxelOfTheSurface) {
  World scene;
  bullet::Shape shape(fine_torus());
  scene.add(shape, 0, btVector3(0, 0, 0));
  const btSphereShape sphere(btScalar(0.02));
  const btTransform from(btQuaternion::getIdentity(), {btScalar(0.1), 0, 1});
  const btTransform to(btQuaternion::getIdentity(), {btScalar(0.1), 0, -1});
  btCollisionWorld::ClosestConvexResultCallback sweep(from.getOrigin(), to.getOrigin());
  scene.world.convexSweepTest(&sphere, from, to, sweep);
  ASSERT_TRUE(sweep.hasHit());
  EXPECT_NEAR(1 - 2 * double(sweep.m_closestHitFraction), 0.05, 0.004);
  // Through the hole.
  btCollisionWorld::ClosestConvexResultCallback through({0, 0, 1}, {0, 0, -1});
  scene.world.convexSweepTest(&sphere, btTransform(btQuaternion::getIdentity(), {0, 0, 1}),
                              btTransform(btQuaternion::getIdentity(), {0, 0, -1}), through);
  EXPECT_FALSE(through.hasHit());
}

struct CountLines final : btIDebugDraw {
  int lines = 0;
  double farthest = 0;
  void drawLine(const btVector3& from, const btVector3& to, const btVector3&) override {
    ++lines;
    farthest = std::max({farthest, double(from.length()), double(to.length())});
  }
  void drawContactPoint(const btVector3&, const btVector3&, btScalar, int, const btVector3&) override {}
  void reportErrorWarning(const char*) override {}
  void draw3dText(const btVector3&, const char*) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return DBG_DrawWireframe; }
};

TEST(DebugDrawing, ShowsTheSurface) {
  World scene;
  bullet::Shape shape(fine_torus());
  scene.add(shape, 0, btVector3(0, 0, 0));
  CountLines drawn;
  scene.world.setDebugDrawer(&drawn);
  scene.world.debugDrawWorld();
  EXPECT_GT(drawn.lines, 3 * static_cast<int>(shape.pointshell().points) - 1);
  EXPECT_NEAR(drawn.farthest, 0.13, 0.02);
}

TEST(Character, WalksOnOurGroundAndStopsAtOurWall) {
  World scene;
  btGhostPairCallback callback;
  scene.world.getPairCache()->setInternalGhostPairCallback(&callback);
  bullet::Shape ground(baked_at(make_box({2, 1, 0.2}), 0.05));
  bullet::Shape wall(baked_at(make_box({0.2, 1, 1}), 0.05));
  scene.add(ground, 0, {0, 0, btScalar(-0.2)});
  scene.add(wall, 0, {btScalar(1.5), 0, 1});
  btPairCachingGhostObject ghost;
  btCapsuleShapeZ capsule(btScalar(0.2), btScalar(0.6));
  ghost.setCollisionShape(&capsule);
  ghost.setCollisionFlags(btCollisionObject::CF_CHARACTER_OBJECT);
  ghost.setWorldTransform(btTransform(btQuaternion::getIdentity(), {-1, 0, btScalar(0.6)}));
  scene.world.addCollisionObject(&ghost, btBroadphaseProxy::CharacterFilter,
                                 btBroadphaseProxy::StaticFilter | btBroadphaseProxy::DefaultFilter);
  btKinematicCharacterController character(&ghost, &capsule, btScalar(0.1), {0, 0, 1});
  character.setGravity({0, 0, btScalar(-9.81)});
  scene.world.addAction(&character);
  scene.step(60);
  EXPECT_NEAR(ghost.getWorldTransform().getOrigin().z(), 0.5, 0.06);
  character.setWalkDirection({btScalar(0.01), 0, 0});
  scene.step(60);
  EXPECT_NEAR(ghost.getWorldTransform().getOrigin().x(), -0.4, 0.05);
  scene.step(240);
  EXPECT_LT(ghost.getWorldTransform().getOrigin().x(), 1.15);
  EXPECT_GT(ghost.getWorldTransform().getOrigin().x(), 1);
  EXPECT_NEAR(ghost.getWorldTransform().getOrigin().z(), 0.5, 0.06);
  scene.world.removeAction(&character);
  scene.world.removeCollisionObject(&ghost);
}

}  // namespace
}  // namespace vps::test

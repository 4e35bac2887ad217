// SPDX-License-Identifier: GPL-3.0-or-later
// A pair that was apart has the contacts of a new pair, to the bit, however its bodies move and change.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

#include "runtime/bullet/convert.h"
#include "runtime/bullet/partners/partner.h"
#include "tests/runtime/bullet/mesh_ground.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

// What moves in a test: in a world that remembers, and in one whose pairs are new in each step.
struct Flight {
  btCollisionShape* ground;
  btCollisionShape* flying;
  double away;                                   // of the bodies' centres, where they hardly touch. [m]
  std::function<void(int)> change = [](int) {};  // of the shapes, before a step
};

struct FlightPlace {
  btTransform at[2];
  btVector3 linear[2], angular[2];
};

void put(World& world, const FlightPlace& place, btScalar step) {
  for (std::size_t i = 0; i < 2; ++i) {
    world.bodies[i]->setWorldTransform(place.at[i]);
    world.bodies[i]->setInterpolationWorldTransform(place.at[i]);
    world.bodies[i]->setLinearVelocity(place.linear[i]);
    world.bodies[i]->setAngularVelocity(place.angular[i]);
  }
  world.world.getDispatchInfo().m_timeStep = step;
  world.world.performDiscreteCollisionDetection();
}

void make_new_pair(World& world) {
  world.broadphase.getOverlappingPairCache()->cleanProxyFromPairs(world.bodies[1]->getBroadphaseHandle(),
                                                                  &world.dispatcher);
}

bool are_equal(const std::vector<btManifoldPoint>& a, const std::vector<btManifoldPoint>& b) {
  if (a.size() != b.size()) return false;
  const auto same = [](const btVector3& p, const btVector3& q) {
    return p.x() == q.x() && p.y() == q.y() && p.z() == q.z();
  };
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!same(a[i].m_positionWorldOnA, b[i].m_positionWorldOnA) ||
        !same(a[i].m_positionWorldOnB, b[i].m_positionWorldOnB) ||
        !same(a[i].m_normalWorldOnB, b[i].m_normalWorldOnB) || a[i].m_distance1 != b[i].m_distance1) {
      return false;
    }
  }
  return true;
}

struct FlightCount {
  int apart = 0, first_touches = 0;
};

// Flies about near the ground, which moves too, until it touches. Now and then it stands still, its speed is none of
// its motion, and the step has any length.
void fly(const Flight& scene, std::uint64_t seed, World& remembers, World& forgets, FlightCount& count) {
  Random random(seed);
  const auto vector = [&](double size) {
    return btVector3(btScalar(random.between(-size, size)), btScalar(random.between(-size, size)),
                     btScalar(random.between(-size, size)));
  };
  const auto turned = [](const btTransform& at, const btVector3& by) {
    if (!(by.length() > 0)) return at;
    return btTransform(btQuaternion(by.normalized(), by.length()) * at.getRotation(), at.getOrigin());
  };
  const double moves = std::pow(10, random.between(-4, -2));  // [m]
  const double turns = random.next() < 0.4 ? 0 : std::pow(10, random.between(-3, -0.3));
  const bool is_moved = random.next() < 0.5;  // the ground
  FlightPlace place{
      {btTransform::getIdentity(), btTransform::getIdentity()}, {{0, 0, 0}, {0, 0, 0}}, {{0, 0, 0}, {0, 0, 0}}};
  const btVector3 there = vector(0.02) + btVector3(0, 0, btScalar(scene.away + random.between(0.002, 0.03)));
  place.at[1] = turned(btTransform(btQuaternion::getIdentity(), there), vector(0.5));
  btVector3 course = vector(moves) - btVector3(0, 0, btScalar(moves / 2));
  make_new_pair(remembers);
  for (int i = 0; i < 60; ++i) {
    scene.change(i);
    const auto step = btScalar(random.next() < 0.5 ? 1.0 / 240 : random.between(1e-4, 0.05));
    if (random.next() < 0.8) {
      place.at[1].getOrigin() += course;
      place.linear[1] = random.next() < 0.7 ? course / step : vector(1);
    }
    const btVector3 turn = vector(turns);
    if (turns > 0 && random.next() < 0.8) {
      place.at[1] = turned(place.at[1], turn);
      place.angular[1] = turn / step;
    }
    if (is_moved) {
      const btVector3 both = vector(moves);
      for (btTransform& at : place.at) at.getOrigin() += both;
      place.at[0] = turned(place.at[0], btScalar(0.2) * vector(turns));
    }
    put(remembers, place, step);
    make_new_pair(forgets);
    put(forgets, place, step);
    const auto known = remembers.points();
    const auto expected = forgets.points();
    ASSERT_TRUE(are_equal(known, expected))
        << "seed " << seed << ", step " << i << ": " << known.size() << " instead of " << expected.size();
    if (!known.empty()) {
      ++count.first_touches;
      return;
    }
    ++count.apart;
  }
}

void expect_alike(const Flight& scene, int flights = 150) {
  FlightCount count;
  World remembers, forgets;
  for (World* const world : {&remembers, &forgets}) {
    world->add(*scene.ground, 0, btTransform::getIdentity());
    world->add(*scene.flying, 1, btTransform::getIdentity());
  }
  for (int seed = 1; seed <= flights; ++seed) {
    fly(scene, std::uint64_t(seed), remembers, forgets, count);
    if (::testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(count.apart, 2 * flights);
  EXPECT_GT(count.first_touches, flights / 15);
}

TEST(KnownGap, ItChangesNoContactWithAnyPartner) {
  bullet::Shape shape(brick());
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  bullet::Shape ring(torus());
  btBoxShape box({btScalar(0.3), btScalar(0.3), btScalar(0.1)});
  btSphereShape round(btScalar(0.2));
  btCapsuleShapeX capsule(btScalar(0.1), btScalar(0.3));
  btStaticPlaneShape plane({0, 0, 1}, btScalar(0.1));
  btConvexHullShape hull;
  for (const double x : {-0.3, 0.3}) {
    for (const double y : {-0.3, 0.3}) {
      for (const double z : {-0.1, 0.1}) hull.addPoint({btScalar(x), btScalar(y), btScalar(z)});
    }
  }
  Ground triangles(Kind::bvh, 0.3, 8);
  const std::pair<btCollisionShape*, double> grounds[] = {{&slab, 0.15},        {&ring, 0.09},      {&box, 0.15},
                                                          {&round, 0.25},       {&capsule, 0.15},   {&plane, 0.15},
                                                          {&hull, 0.15 + 0.04}, {&*triangles, 0.05}};
  for (const auto& [ground, away] : grounds) expect_alike({ground, &shape, away});
}

// A small ball or a corner meets the surface between the points of the shell, nearer than any of them.
TEST(KnownGap, ItChangesNoContactBetweenThePoints) {
  const std::shared_ptr<Asset> asset = baked_at(make_box({0.3, 0.3, 0.1}), 0.01);
  bullet::Shape slab(asset);
  btSphereShape round(btScalar(0.004));
  btBoxShape box({btScalar(0.004), btScalar(0.004), btScalar(0.004)});
  expect_alike({&slab, &round, 0.094});
  expect_alike({&slab, &box, 0.096});
  bullet::Shape points(asset, bullet::Part::pointshell);
  bullet::Shape cube(baked_at(make_box({0.02, 0.02, 0.02}), 0.002));
  expect_alike({&points, &cube, 0.122});
}

TEST(KnownGap, TheArmOfAShapeHoldsItsPoints) {
  const auto asset = baked_at(make_box({0.2, 0.02, 0.05}, {1, 2, 3}), 0.005);
  for (const bullet::Axes axes : {bullet::Axes::of_asset, bullet::Axes::principal}) {
    for (const double scale : {1.0, 2.5}) {
      bullet::Shape shape(asset, bullet::Part::mixed, axes);
      shape.setLocalScaling(btScalar(scale) * btVector3(1, 1, 1));
      shape.setMargin(btScalar(0.01));
      const btCollisionObject object;
      const btTransform at = btTransform::getIdentity();
      const float arm = bullet::arm_of(bullet::PairBody(&shape, &object, at));
      double farthest = 0;
      for (std::uint32_t i = 0; i < shape.pointshell().points; ++i) {
        const btVector3 p = bullet::to_bt(point_position(shape.pointshell(), i));
        farthest = std::max(farthest, double((shape.asset_frame() * p).length()));
      }
      EXPECT_GE(double(arm), farthest);
      EXPECT_LT(double(arm), farthest + 0.02 * scale);
    }
  }
}

TEST(KnownGap, ItChangesNoContactOfShellsThatMeetBothWays) {
  bake::BakeOptions options;
  options.voxel_size = 0.004;
  options.thin_faces = 4;
  bullet::Shape shape(baked(make_box({0.05, 0.05, 0.05}), options));
  bullet::Shape other(baked(make_box({0.08, 0.08, 0.03}), options));
  expect_alike({&other, &shape, 0.08});
}

TEST(KnownGap, ItChangesNoContactOfChildrenOfCompounds) {
  bullet::Shape shape(brick());
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  btCompoundShape pair;
  pair.addChildShape(btTransform(btQuaternion({0, 1, 0}, btScalar(0.4)), {btScalar(-0.2), 0, btScalar(0.05)}), &shape);
  pair.addChildShape(btTransform(btQuaternion({1, 0, 0}, btScalar(0.7)), {btScalar(0.2), 0, 0}), &shape);
  expect_alike({&slab, &pair, 0.17});
  expect_alike({&pair, &shape, 0.1});
}

// The ends of a rod come near where its centre stays. Either body turns, by itself or as a child of a compound.
TEST(KnownGap, ItKnowsHowFarTheEndsOfABodyTurn) {
  bullet::Shape rod(baked_at(make_box({0.3, 0.02, 0.02}), 0.005));
  bullet::Shape slab(baked_at(make_box({0.4, 0.4, 0.1}), 0.01));
  btBoxShape box({btScalar(0.4), btScalar(0.4), btScalar(0.1)});
  btCompoundShape arm;
  arm.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.3), 0, 0}), &rod);
  const std::pair<btCollisionShape*, btCollisionShape*> pairs[] = {
      {&slab, &rod}, {&box, &rod}, {&slab, &arm}, {&box, &arm}};
  for (const auto& [ground, turning] : pairs) {
    for (const std::size_t turned : {0, 1}) {
      for (const double by : {0.002, 0.02}) {
        World remembers, forgets;
        const btTransform above(btQuaternion::getIdentity(), {0, 0, btScalar(0.18)});
        FlightPlace place{{btTransform::getIdentity(), above}, {{0, 0, 0}, {0, 0, 0}}, {{0, 0, 0}, {0, 0, 0}}};
        for (World* const world : {&remembers, &forgets}) {
          world->add(*ground, 0, place.at[0]);
          world->add(*turning, 1, place.at[1]);
        }
        int apart = 0;
        for (int i = 0; i * by < 0.4; ++i) {
          place.at[turned].setRotation(btQuaternion({0, 1, 0}, btScalar(turned == 0 ? -i * by : i * by)));
          put(remembers, place, 0);
          make_new_pair(forgets);
          put(forgets, place, 0);
          ASSERT_TRUE(are_equal(remembers.points(), forgets.points())) << turned << ", step " << i << " of " << by;
          if (!remembers.points().empty()) break;
          ++apart;
        }
        EXPECT_GT(apart, 0.05 / by);
        EXPECT_FALSE(remembers.points().empty());
      }
    }
  }
}

TEST(KnownGap, ItEndsWhenAShapeChanges) {
  for (const bool of_ground : {false, true}) {
    bullet::Shape shape(brick());
    bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
    bullet::Shape& changed = of_ground ? slab : shape;
    const auto scale = [&](int i) {
      const double to = 1 + 0.02 * (i / 10 % 3);
      changed.setLocalScaling({btScalar(to), btScalar(to), btScalar(to)});
    };
    expect_alike({&slab, &shape, 0.16, scale});
    scale(0);
    const auto thicken = [&](int i) { changed.setMargin(btScalar(0.004 * (i / 10 % 3))); };
    expect_alike({&slab, &shape, 0.16, thicken});
  }
  bullet::Shape shape(brick());
  btSphereShape round(btScalar(0.2));
  expect_alike({&round, &shape, 0.26, [&](int i) { round.setUnscaledRadius(btScalar(0.2 + 0.01 * (i / 10 % 2))); }});
  btConvexHullShape hull;
  for (const double x : {-0.3, 0.3}) {
    for (const double y : {-0.3, 0.3}) hull.addPoint({btScalar(x), btScalar(y), btScalar(0.1)});
  }
  hull.addPoint({0, 0, btScalar(-0.1)});
  expect_alike({&hull, &shape, 0.18, [&](int i) { hull.setMargin(btScalar(0.01 * (1 + i / 10 % 3))); }});
  btBoxShape box({btScalar(0.3), btScalar(0.3), btScalar(0.1)});
  expect_alike({&box, &shape, 0.17, [&](int i) { box.setLocalScaling({1, 1, btScalar(1 + 0.1 * (i / 10 % 2))}); }});
}

// A program may destroy a body's shape and make another in its place, which then has the same address.
TEST(KnownGap, ItEndsWhenAShapeTakesTheMemoryOfAnother) {
  btBoxShape ground({btScalar(0.3), btScalar(0.3), btScalar(0.1)});
  std::optional<bullet::Shape> shape(brick());
  const auto large = baked_at(make_box({0.15, 0.1, 0.08}), 0.01);
  expect_alike({&ground, &*shape, 0.17, [&](int i) { shape.emplace(i / 10 % 2 == 0 ? brick() : large); }});
  bullet::Shape flying(brick());
  using Box = btBoxShape;
  std::variant<Box, btCapsuleShapeZ> shapes(std::in_place_type<Box>, btVector3(0.3F, 0.3F, 0.1F));
  const auto change = [&](int i) {
    const bool is_thick = i / 10 % 2 != 0;
    if (i / 20 % 2 == 0) {
      shapes.emplace<Box>(btVector3(0.3F, 0.3F, is_thick ? 0.1F : 0.07F));
    } else {
      shapes.emplace<btCapsuleShapeZ>(0.05F, is_thick ? 0.2F : 0.1F);
    }
  };
  expect_alike({&std::get<Box>(shapes), &flying, 0.17, change});
}

TEST(KnownGap, ItEndsWhenTrianglesMove) {
  constexpr btScalar kHalf = btScalar(0.3);
  btScalar corners[] = {-kHalf, -kHalf, 0, kHalf, -kHalf, 0, kHalf, kHalf, 0, -kHalf, kHalf, 0};
  int triangles[] = {0, 1, 2, 0, 2, 3};
  btTriangleIndexVertexArray mesh(2, triangles, 3 * sizeof(int), 4, corners, 3 * sizeof(btScalar));
  btBvhTriangleMeshShape ground(&mesh, true);
  bullet::Shape shape(brick());
  World scene;
  // Tilted, so that the bodies' boxes overlap.
  const btTransform tilted(btQuaternion({0, 1, 0}, btScalar(0.5)));
  scene.add(ground, 0, tilted);
  scene.add(shape, 1, tilted * btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.2)}));
  for (int i = 0; i < 3; ++i) scene.world.performDiscreteCollisionDetection();
  ASSERT_EQ(scene.broadphase.getOverlappingPairCache()->getNumOverlappingPairs(), 1);
  EXPECT_TRUE(scene.points().empty());
  for (const int z : {2, 5, 8, 11}) corners[z] = btScalar(0.152);
  ground.refitTree({-kHalf, -kHalf, 0}, {kHalf, kHalf, kHalf});
  scene.world.performDiscreteCollisionDetection();
  EXPECT_FALSE(scene.points().empty());
}

// A program may ask a pair's algorithm for contacts at any distance.
TEST(KnownGap, ItDoesNotHideContactsAtAGreaterDistance) {
  bullet::Shape shape(brick());
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  World scene;
  scene.add(slab, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.156)});
  for (int i = 0; i < 3; ++i) scene.world.performDiscreteCollisionDetection();
  ASSERT_TRUE(scene.points().empty());
  ASSERT_EQ(scene.broadphase.getOverlappingPairCache()->getNumOverlappingPairs(), 1);
  const btBroadphasePair& pair = scene.broadphase.getOverlappingPairCache()->getOverlappingPairArray()[0];
  btCollisionAlgorithm& algorithm = *pair.m_algorithm;
  btCollisionObject* const first = static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  btCollisionObject* const second = static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  const btCollisionObjectWrapper a(nullptr, first->getCollisionShape(), first, first->getWorldTransform(), -1, -1);
  const btCollisionObjectWrapper b(nullptr, second->getCollisionShape(), second, second->getWorldTransform(), -1, -1);
  for (const double distance : {0.0, 0.005, 0.0075, 0.005, 0.0075}) {
    btManifoldResult result(&a, &b);
    result.m_closestPointDistanceThreshold = btScalar(distance);
    algorithm.processCollision(&a, &b, scene.world.getDispatchInfo(), &result);
    EXPECT_EQ(scene.points().empty(), distance < 0.006) << distance;
  }
  // What is far away again leaves nothing behind.
  body.getWorldTransform().getOrigin().setZ(btScalar(0.16));
  scene.world.performDiscreteCollisionDetection();
  EXPECT_TRUE(scene.points().empty());
}

}  // namespace
}  // namespace vps::test

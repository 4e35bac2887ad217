// SPDX-License-Identifier: GPL-3.0-or-later
// Piles, chains and bodies on slopes, from several starts, beside Bullet's own shapes where it has them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/runtime/bullet/world.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

constexpr int kStarts = 3;

// A world with the settings that lint advises. @param voxel  [m]
struct Advised : World {
  explicit Advised(double voxel, int iterations = 10) : World(voxel) {
    world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    world.getSolverInfo().m_numIterations = iterations;
  }
};

btVector3 aside(Random& random, double far) {
  const double x = random.between(-far, far);
  return {btScalar(x), btScalar(random.between(-far, far)), 0};
}

btMatrix3x3 any_rotation(Random& random) {
  const std::array<double, 9> r = random.rotation();
  return {btScalar(r[0]), btScalar(r[1]), btScalar(r[2]), btScalar(r[3]), btScalar(r[4]),
          btScalar(r[5]), btScalar(r[6]), btScalar(r[7]), btScalar(r[8])};
}

// Time until one of the moving bodies is `far` from its place. [s]
double stands(World& scene, double far, double rate, double seconds) {
  std::vector<btVector3> places;
  for (const auto& body : scene.bodies) places.push_back(body->getWorldTransform().getOrigin());
  for (int i = 1; i <= int(std::lround(seconds * rate)); ++i) {
    scene.step(1, btScalar(1 / rate));
    for (std::size_t b = 0; b < places.size(); ++b) {
      const btVector3 moved = scene.bodies[b]->getWorldTransform().getOrigin() - places[b];
      if (!(double(moved.length()) <= far)) return i / rate;
    }
  }
  return seconds;
}

TEST(Standing, BallsStandOnEachOtherAsLongAsSpheres) {
  constexpr double kRadius = 0.5;
  constexpr double kVoxel = 0.01;
  bullet::Shape ball(baked_at(make_sphere(kRadius, 5), kVoxel));
  btSphereShape sphere{btScalar(kRadius)};
  btStaticPlaneShape plane({0, 0, 1}, 0);
  const btVector3 inertia = btVector3(1, 1, 1) * btScalar(0.4 * kRadius * kRadius);
  for (const double rate : {60.0, 240.0}) {
    for (const int count : {2, 3, 5}) {
      double times[2] = {0, 0};
      for (int start = 0; start < 2 * kStarts; ++start) {
        Advised scene(kVoxel);
        scene.add(plane, 0, btVector3(0, 0, 0));
        Random random(std::uint64_t(start / 2 + 1));
        for (int i = 0; i < count; ++i) {
          btTransform at(any_rotation(random), aside(random, 0.01 * kRadius));
          at.getOrigin().setZ(btScalar((2 * i + 1) * kRadius));
          btRigidBody& body = scene.add(start % 2 == 0 ? static_cast<btCollisionShape&>(ball) : sphere, 1, at);
          body.setMassProps(1, inertia);
        }
        times[start % 2] += stands(scene, 0.5 * kRadius, rate, 5);
      }
      EXPECT_GT(times[0], 0.8 * times[1]) << count << " balls at " << rate << " Hz";
    }
  }
}

constexpr double kSide = 0.02;  // of a cube. [m]

bullet::Shape& cube() {
  static bullet::Shape shape(baked_at(make_box({kSide / 2, kSide / 2, kSide / 2}), kSide / 25));
  return shape;
}

void add_cube(World& scene, Random& random, const btVector3& place) {
  const btQuaternion turn(btVector3(0, 0, 1), btScalar(random.between(-0.03, 0.03)));
  scene.add(cube(), btScalar(0.008), btTransform(turn, place + aside(random, 0.02 * kSide)));
}
void add_pyramid(World& scene, Random& random) {
  for (int row = 0; row < 4; ++row) {
    for (int i = 0; i < 4 - row; ++i) {
      add_cube(scene, random, {btScalar((i + 0.5 * row) * 1.1 * kSide), 0, btScalar((row + 0.5) * kSide)});
    }
  }
}
void add_stack(World& scene, Random& random) {
  for (int i = 0; i < 10; ++i) add_cube(scene, random, {0, 0, btScalar((i + 0.5) * kSide)});
}

// Cubes stand for 2 s from each start.
void expect_to_stand(void (*add_cubes)(World&, Random&), double rate) {
  btStaticPlaneShape plane({0, 0, 1}, 0);
  for (int start = 0; start < kStarts; ++start) {
    Advised scene(kSide / 25, 50);
    scene.add(plane, 0, btVector3(0, 0, 0));
    Random random(std::uint64_t(start + 1));
    add_cubes(scene, random);
    EXPECT_EQ(stands(scene, 0.25 * kSide, rate, 2), 2) << "start " << start;
  }
}

TEST(Standing, PyramidsOfCubesStandAt60Hz) {
  expect_to_stand(add_pyramid, 60);
}

TEST(Standing, TenCubesStandAt240Hz) {
  expect_to_stand(add_stack, 240);
}

// Where contacts ahead are needed in long steps only, they come and go.
TEST(Standing, FiveCubesStandWithLongAndShortStepsInTurn) {
  btStaticPlaneShape plane({0, 0, 1}, 0);
  for (const double rate : {100.0, 240.0}) {
    for (int start = 0; start < kStarts; ++start) {
      Advised scene(kSide / 25);
      scene.add(plane, 0, btVector3(0, 0, 0));
      Random random(std::uint64_t(start + 1));
      for (int i = 0; i < 5; ++i) add_cube(scene, random, {0, 0, btScalar((i + 0.5) * kSide)});
      for (int i = 0; i < 300; ++i) {
        scene.step(1, btScalar(1 / 60.0));
        scene.step(1, btScalar(1 / rate));
      }
      EXPECT_GT(scene.bodies.back()->getWorldTransform().getOrigin().z(), 4.25 * kSide)
          << rate << " Hz, start " << start;
    }
  }
}

TEST(Standing, CornersAndEdgesOfStackedCubesMeetFaces) {
  for (int start = 0; start < kStarts; ++start) {
    Advised scene(kSide / 25);
    Random random(std::uint64_t(start + 1));
    add_stack(scene, random);
    scene.world.performDiscreteCollisionDetection();
    const auto points = scene.points();
    EXPECT_GE(points.size(), 27U);
    for (const btManifoldPoint& point : points) EXPECT_GT(std::abs(point.m_normalWorldOnB.z()), 0.996);  // 5 degrees
  }
}

// Contacts stay from step to step, with their impulses, once the bodies of a scene rest.
// @param weights  that the contacts carry in all, over that of one moving body
void expect_contacts_to_stay(World& scene, double rate, double weights) {
  scene.step(int(rate), btScalar(1 / rate));
  std::size_t young = 0;
  for (int i = 0; i < int(rate); ++i) {
    scene.step(1, btScalar(1 / rate));
    const auto points = scene.points();
    EXPECT_GE(points.size(), 4U);
    for (const btManifoldPoint& point : points) young += point.getLifeTime() < 1 ? 1U : 0U;
  }
  EXPECT_EQ(young, 0U);
  // Before the next solution: what warm starting begins with. Where the fall of a step is several voxels, a detection
  // without gravity seeks other contacts.
  if (rate < 240) return;
  scene.world.performDiscreteCollisionDetection();
  double carried = 0;
  for (const btManifoldPoint& point : scene.points()) carried += double(point.m_appliedImpulse);
  EXPECT_NEAR(carried * double(scene.bodies.back()->getInvMass()) * rate / 9.81, weights, 0.02 * weights);
}

TEST(Standing, ContactsOfBodiesAtRestStayFromStepToStep) {
  bullet::Shape slab(baked_at(make_box({0.1, 0.1, 0.02}), 0.002));
  bullet::Shape block(baked_at(make_box({0.05, 0.03, 0.02}), 0.002));
  for (int run = 0; run < 3 * kStarts; ++run) {
    const double rate = run % 3 == 0 ? 60 : run % 3 == 1 ? 240 : 1000;
    Random random(std::uint64_t(run / 3 + 1));
    Advised stack(kSide / 25, 50);
    stack.add(slab, 0, btVector3(0, 0, btScalar(-0.02)));
    for (int i = 0; i < 2; ++i) add_cube(stack, random, {0, 0, btScalar((i + 0.5) * kSide)});
    expect_contacts_to_stay(stack, rate, 3);  // the lower cube carries the upper one as well
    Advised single(0.002);
    single.add(slab, 0, btVector3(0, 0, btScalar(-0.02)));
    const btQuaternion turn(btVector3(0, 0, 1), btScalar(random.between(-3, 3)));
    single.add(block, btScalar(0.5), btTransform(turn, btVector3(0, 0, btScalar(0.021)) + aside(random, 0.03)));
    expect_contacts_to_stay(single, rate, 1);
  }
}

// At 60 Hz a cube falls by 3.4 voxels in a step, at 100 Hz by 1.2.
// A flag of Bullet's, without a callback, makes each step clear its points and add them again.
TEST(Standing, PointsThatStayMoveAsPointsAddedAgain) {
  bullet::Shape slab(baked_at(make_box({0.1, 0.1, 0.01}), 0.001));
  btBoxShape box({btScalar(0.1), btScalar(0.1), btScalar(0.01)});
  // A user's own combination.
  const CalculateCombinedCallback usual = gCalculateCombinedFrictionCallback;
  gCalculateCombinedFrictionCallback = [](const btCollisionObject* a, const btCollisionObject* b) {
    return btScalar(0.5) * a->getFriction() + btScalar(0.1) * b->getFriction();
  };
  for (btCollisionShape* const ground : {static_cast<btCollisionShape*>(&slab), static_cast<btCollisionShape*>(&box)}) {
    for (const bool is_first : {false, true}) {
      Advised scenes[2] = {Advised(kSide / 25), Advised(kSide / 25)};
      for (Advised& scene : scenes) {
        if (is_first) scene.add(*ground, 0, btVector3(0, 0, btScalar(-0.01)));
        btRigidBody& body = scene.add(cube(), btScalar(0.008), btVector3(0, 0, btScalar(0.011)));
        if (!is_first) scene.add(*ground, 0, btVector3(0, 0, btScalar(-0.01)));
        body.setFriction(btScalar(0.3));
      }
      btRigidBody& again = *scenes[1].bodies[is_first ? 1 : 0];
      again.setCollisionFlags(again.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
      int stayed = 0;
      for (int i = 0; i < 240; ++i) {
        std::vector<btManifoldPoint> points[2];
        for (int side = 0; side < 2; ++side) {
          btRigidBody& body = *scenes[side].bodies[is_first ? 1 : 0];
          // It lies, is pushed, and slides with another friction.
          if (i == 120) body.setLinearVelocity({btScalar(0.2), btScalar(0.1), 0});
          if (i == 130) body.setFriction(btScalar(0.1));
          scenes[side].step(1);
          points[side] = scenes[side].points();
        }
        ASSERT_EQ(points[0].size(), points[1].size()) << i;
        for (std::size_t k = 0; k < points[0].size(); ++k) {
          const btManifoldPoint& a = points[0][k];
          const btManifoldPoint& b = points[1][k];
          stayed += a.m_lifeTime > 0 ? 1 : 0;
          EXPECT_EQ(a.m_lifeTime, b.m_lifeTime) << i;
          EXPECT_EQ(a.m_localPointA, b.m_localPointA) << i;
          EXPECT_EQ(a.m_localPointB, b.m_localPointB) << i;
          EXPECT_EQ(a.m_positionWorldOnA, b.m_positionWorldOnA) << i;
          EXPECT_EQ(a.m_positionWorldOnB, b.m_positionWorldOnB) << i;
          EXPECT_EQ(a.m_normalWorldOnB, b.m_normalWorldOnB) << i;
          EXPECT_EQ(a.m_distance1, b.m_distance1) << i;
          EXPECT_EQ(a.m_combinedFriction, b.m_combinedFriction) << i;
          EXPECT_EQ(a.m_combinedRestitution, b.m_combinedRestitution) << i;
          EXPECT_EQ(a.m_appliedImpulse, b.m_appliedImpulse) << i;
          EXPECT_EQ(a.m_appliedImpulseLateral1, b.m_appliedImpulseLateral1) << i;
          EXPECT_EQ(a.m_prevRHS, b.m_prevRHS) << i;
          EXPECT_EQ(a.m_lateralFrictionDir1, b.m_lateralFrictionDir1) << i;
        }
      }
      EXPECT_GT(stayed, 400);
    }
  }
  gCalculateCombinedFrictionCallback = usual;
}

// How often Bullet calls the callbacks of contacts, and how many data the user has made and freed.
struct Calls {
  int started = 0, ended = 0, added = 0, processed = 0, destroyed = 0;
};
Calls calls;
class Listening {
 public:
  Listening() {
    calls = {};
    gContactStartedCallback = [](btPersistentManifold* const&) { ++calls.started; };
    gContactEndedCallback = [](btPersistentManifold* const&) { ++calls.ended; };
    gContactProcessedCallback = [](btManifoldPoint&, void*, void*) { return ++calls.processed > 0; };
    gContactDestroyedCallback = [](void* data) {
      delete static_cast<int*>(data);
      return ++calls.destroyed > 0;
    };
    gContactAddedCallback = [](btManifoldPoint& p, const btCollisionObjectWrapper*, int, int,
                               const btCollisionObjectWrapper*, int, int) {
      if (p.m_userPersistentData == nullptr) p.m_userPersistentData = new int(++calls.added);
      p.m_combinedFriction = 0;
      return true;
    };
  }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;
  ~Listening() {
    gContactStartedCallback = nullptr, gContactEndedCallback = nullptr, gContactProcessedCallback = nullptr;
    gContactDestroyedCallback = nullptr, gContactAddedCallback = nullptr;
  }
};

// Callbacks as Bullet calls them for its own shapes, also where the points move, and change, over the ground.
TEST(Standing, TheUsersCallbacksKnowTheContactsThatStay) {
  const Listening listening;
  bullet::Shape slab(baked_at(make_box({0.1, 0.1, 0.01}), 0.001));
  for (const bool custom : {false, true}) {
    Advised scene(kSide / 25);
    scene.add(slab, 0, btVector3(0, 0, btScalar(-0.01)));
    btRigidBody& body = scene.add(cube(), btScalar(0.008), btVector3(0, 0, btScalar(0.0101)));
    if (custom) body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    scene.step(120);
    calls = {};
    scene.step(120);
    EXPECT_EQ(calls.started, 0) << custom;
    EXPECT_EQ(calls.ended, 0) << custom;
    EXPECT_EQ(calls.processed, 4 * 120) << custom;
    EXPECT_EQ(calls.added, 0) << custom;
    EXPECT_EQ(calls.destroyed, 0) << custom;
  }
  // A ball's points in contact change as it rolls.
  bullet::Shape ball(baked_at(make_sphere(0.01, 3), 0.001));
  Advised scene(kSide / 25);
  scene.add(slab, 0, btVector3(0, 0, btScalar(-0.01)));
  btRigidBody& body = scene.add(ball, btScalar(0.008), btVector3(btScalar(-0.05), 0, btScalar(0.0099)));
  body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
  scene.step(10);
  body.setLinearVelocity({btScalar(0.005), 0, 0});
  body.setAngularVelocity({0, btScalar(0.5), 0});
  calls.started = calls.ended = 0;
  scene.step(120);
  EXPECT_EQ(calls.started, 0);
  EXPECT_EQ(calls.ended, 0);
  EXPECT_LT(calls.added, 30) << "points that stay are not made anew in each of the 120 steps";
  int old = 0;
  for (const btManifoldPoint& p : scene.points()) {
    ASSERT_NE(p.m_userPersistentData, nullptr);
    if (p.getLifeTime() < 20) continue;
    ++old;
    EXPECT_LT(*static_cast<int*>(p.m_userPersistentData), calls.added - 2) << "data made when the point was";
  }
  EXPECT_GE(old, 1);
}

// Bullet calls them when a manifold gets its first point and when it is cleared.
TEST(Standing, AContactThatStaysStartsOnce) {
  static int started = 0;
  static int ended = 0;
  gContactStartedCallback = [](btPersistentManifold* const&) { ++started; };
  gContactEndedCallback = [](btPersistentManifold* const&) { ++ended; };
  bullet::Shape slab(baked_at(make_box({0.1, 0.1, 0.01}), 0.001));
  Advised scene(kSide / 25);
  scene.add(slab, 0, btVector3(0, 0, btScalar(-0.01)));
  scene.add(cube(), btScalar(0.008), btVector3(0, 0, btScalar(0.011)));
  scene.step(120);
  EXPECT_GE(started, 1);
  started = ended = 0;
  scene.step(120);
  EXPECT_EQ(scene.points().size(), 4U);
  gContactStartedCallback = nullptr;
  gContactEndedCallback = nullptr;
  EXPECT_EQ(started, 0);
  EXPECT_EQ(ended, 0);
}

TEST(Standing, FiveCubesRestOnTheSameContactsAtLowRates) {
  btStaticPlaneShape plane({0, 0, 1}, 0);
  for (const double rate : {60.0, 100.0}) {
    std::size_t young = 0;
    double energy = 0;
    double given = 0;  // to young contacts, over the weight of a cube
    for (int start = 0; start < 2 * kStarts; ++start) {
      Advised scene(kSide / 25, 50);
      scene.add(plane, 0, btVector3(0, 0, 0));
      Random random(std::uint64_t(start + 1));
      for (int i = 0; i < 5; ++i) add_cube(scene, random, {0, 0, btScalar((i + 0.5) * kSide)});
      scene.step(int(rate), btScalar(1 / rate));
      for (int i = 0; i < int(rate); ++i) {
        scene.step(1, btScalar(1 / rate));
        for (const auto& body : scene.bodies) energy = std::max(energy, kinetic_energy(*body));
        for (const btManifoldPoint& point : scene.points()) {
          if (point.getLifeTime() > 0) continue;
          ++young;
          given = std::max(given, double(point.m_appliedImpulse * scene.bodies.back()->getInvMass()) * rate / 9.81);
        }
      }
    }
    EXPECT_LE(young, 100U) << rate << " Hz";
    EXPECT_LT(energy, 5e-6) << rate << " Hz";  // lifts a cube by a twelfth of a voxel
    EXPECT_LT(given, rate < 100 ? 0.2 : 3) << rate << " Hz";
  }
}

constexpr double kRing = 0.03;   // of a link. [m]
constexpr double kTube = 0.006;  // radius of its section. [m]

// Links hang from a fixed one and swing. @return how deep two of them were in each other. [m]
double depth_in_chain(int links, double rate, int start) {
  static bullet::Shape link(baked_at(make_torus(kRing, kTube, 96, 48), 0.001));
  Advised scene(0.001);
  Random random(std::uint64_t(start + 1));
  for (int i = 0; i <= links; ++i) {
    const double turned = i % 2 == 0 ? 0 : 0.5 * SIMD_PI;
    const btQuaternion turn(btVector3(0, 0, 1), btScalar(turned + (i > 0 ? random.between(-0.1, 0.1) : 0)));
    const btVector3 place(0, 0, btScalar(-i * (2 * (kRing - kTube) - 0.0005)));
    const btTransform at(turn * btQuaternion(btVector3(1, 0, 0), SIMD_HALF_PI),
                         place + aside(random, i > 0 ? 0.0005 : 0));
    scene.add(link, i > 0 ? btScalar(0.1) : 0, at);
  }
  scene.bodies.back()->setLinearVelocity({btScalar(0.5), btScalar(0.2 * start), 0});
  double farthest = 0;
  for (int i = 0; i < 2 * rate; ++i) {
    scene.step(1, btScalar(1 / rate));
    for (std::size_t b = 1; b < scene.bodies.size(); ++b) {
      const btVector3& upper = scene.bodies[b - 1]->getWorldTransform().getOrigin();
      farthest = std::max(farthest, double((scene.bodies[b]->getWorldTransform().getOrigin() - upper).length()));
    }
  }
  return farthest - 2 * (kRing - kTube);
}

TEST(Standing, AChainOfFiveLinksHoldsAt240Hz) {
  for (int start = 0; start < kStarts; ++start) EXPECT_LT(depth_in_chain(5, 240, start), 0.002) << "start " << start;
}

// The solver stops links that fall together one after the other: each needs contacts ahead for its motion alone.
TEST(Standing, ChainsHoldAt60Hz) {
  for (const int links : {5, 10}) {
    for (int start = 0; start < 6; ++start) {
      EXPECT_LT(depth_in_chain(links, 60, start), kTube) << links << " links, start " << start;
    }
  }
}

// A step is a fall of 98 mm from rest, a third of the body's size. Contacts ahead that gathered at one place would let
// it fall in beside them.
TEST(Standing, ARingLandsAndRestsAtTenHertz) {
  constexpr double kVoxel = 0.003;
  bullet::Shape ring(baked_at(make_torus(0.1, 0.03, 64, 32), kVoxel));
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btVector3 inertia;
  ring.calculateLocalInertia(1, inertia);
  for (int start = 0; start < 10; ++start) {
    Random random(static_cast<std::uint64_t>(start) + 1);
    Advised scene(kVoxel);
    scene.add(plane, 0, {0, 0, 0});
    btRigidBody& body = scene.add(ring, 1, btTransform(any_rotation(random), {0, 0, btScalar(0.35)}));
    const auto lowest = [&] {
      const btTransform& at = body.getWorldTransform();
      const btScalar tilt = at.getBasis()[2].z();
      return double(at.getOrigin().z()) - 0.1 * std::sqrt(std::max(0.0, 1 - double(tilt * tilt))) - 0.03;
    };
    double deepest = 0;
    for (int step = 0; step < 200; ++step) {
      scene.step(1, btScalar(0.1));
      deepest = std::max(deepest, -lowest());
    }
    EXPECT_LT(deepest, 5 * kVoxel) << start;
    EXPECT_LT(-lowest(), kVoxel) << start;
  }
}

// Without contacts ahead it sank 12 to 16 mm into the box and trembled there.
TEST(Standing, ARingThatBouncesComesToRestOnTheSurface) {
  constexpr double kVoxel = 0.001;
  bullet::Shape ring(baked_at(make_torus(0.03, 0.01, 64, 32), kVoxel));
  btBoxShape box({btScalar(0.3), btScalar(0.3), btScalar(0.03)});
  for (const double restitution : {0.1, 0.5}) {
    for (const double rate : {60.0, 120.0}) {
      Random random;
      for (int start = 0; start < kStarts; ++start) {
        Advised scene(kVoxel);
        scene.add(box, 0, {0, 0, btScalar(-0.03)}).setRestitution(1);
        btRigidBody& body = scene.add(ring, btScalar(0.1), btTransform(any_rotation(random), {0, 0, btScalar(0.056)}));
        body.setRestitution(btScalar(restitution));
        scene.step(int(4 * rate), btScalar(1 / rate));
        EXPECT_LT(double(body.getLinearVelocity().length()), 0.02) << rate << ' ' << restitution << ' ' << start;
        EXPECT_FALSE(scene.points().empty()) << rate << ' ' << restitution << ' ' << start;
        for (const btManifoldPoint& point : scene.points())
          EXPECT_GT(double(point.getDistance()), -0.5 * kVoxel) << rate;
      }
    }
  }
}

TEST(Standing, BodiesHardlyCreepOnASlope) {
  constexpr double kVoxel = 0.001;
  TriangleMesh wedge = make_box({0.03, 0.02, 0.015});
  for (auto& v : wedge.vertices) {
    if (v[2] > 0) v = {0.6 * v[0] + 0.006, 0.7 * v[1] - 0.003, v[2]};
  }
  bullet::Shape cube(baked_at(make_box({0.02, 0.02, 0.02}), kVoxel));
  bullet::Shape uneven(baked_at(wedge, kVoxel));
  bullet::Shape slab(baked_at(make_box({0.2, 0.2, 0.02}), 2 * kVoxel));
  btStaticPlaneShape plane({0, 0, 1}, btScalar(0.02));
  btBoxShape box({1, 1, btScalar(0.02)});
  const double slope = 20 * SIMD_PI / 180;
  for (btCollisionShape* const ground : {static_cast<btCollisionShape*>(&slab), static_cast<btCollisionShape*>(&plane),
                                         static_cast<btCollisionShape*>(&box)}) {
    for (bullet::Shape* const shape : {&cube, &uneven}) {
      for (int start = 0; start < kStarts; ++start) {
        Advised scene(kVoxel);
        Random random(std::uint64_t(start + 1));
        const double down = random.between(-SIMD_PI, SIMD_PI);
        scene.world.setGravity(btVector3(btScalar(std::sin(slope) * std::cos(down)),
                                         btScalar(std::sin(slope) * std::sin(down)), -btScalar(std::cos(slope))) *
                               btScalar(9.81));
        scene.add(*ground, 0, btVector3(0, 0, btScalar(-0.02))).setFriction(1);
        const double half = shape == &cube ? 0.02 : 0.015;
        btTransform at(btQuaternion(btVector3(0, 0, 1), btScalar(random.between(-3, 3))), aside(random, 0.05));
        at.getOrigin().setZ(btScalar(half + 0.0002) + shape->centre_of_mass().z());
        const btRigidBody& body = scene.add(*shape, btScalar(0.1), at);
        scene.step(240);
        const btVector3 from = body.getWorldTransform().getOrigin();
        scene.step(240);
        EXPECT_LT((body.getWorldTransform().getOrigin() - from).length(), 1e-5)
            << ground->getName() << ", " << half << ", start " << start;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

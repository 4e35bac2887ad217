// SPDX-License-Identifier: GPL-3.0-or-later
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <thread>
#include <type_traits>

#include "tests/runtime/bullet/mesh_ground.h"

namespace vps::test {
namespace {

// A brick rests at the right height with sound contacts on each kind of ground, whichever body was added first.
enum class RestGround { box, sphere, plane, vps };
class Rest : public testing::TestWithParam<std::tuple<RestGround, bool>> {};

TEST_P(Rest, ABodyStaysOnItsGroundInEitherOrder) {
  const auto [ground, ground_first] = GetParam();
  World scene;
  bullet::Shape brick_shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btSphereShape sphere(100);
  btStaticPlaneShape plane({0, 0, 1}, 0);
  const bullet::Shape slab_shape(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  btCollisionShape* shapes[] = {&box, &sphere, &plane, const_cast<bullet::Shape*>(&slab_shape)};
  const btScalar heights[] = {btScalar(-0.5), -100, 0, btScalar(-0.1)};
  const auto kind = static_cast<std::size_t>(ground);
  const btVector3 start(0, 0, btScalar(0.06));
  btRigidBody* body = nullptr;
  btRigidBody* floor = nullptr;
  if (ground_first) floor = &scene.add(*shapes[kind], 0, {0, 0, heights[kind]});
  body = &scene.add(brick_shape, 1, start);
  if (!ground_first) floor = &scene.add(*shapes[kind], 0, {0, 0, heights[kind]});
  scene.step(480);
  EXPECT_EQ(brick_shape.status(), Status::ok);
  EXPECT_NEAR(body->getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(*body), 0.005);

  int contacts = 0;
  for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
    const btPersistentManifold* manifold = scene.dispatcher.getManifoldByIndexInternal(m);
    const bool body_is_first = manifold->getBody0() == body;
    ASSERT_TRUE(body_is_first || manifold->getBody0() == floor);
    for (int i = 0; i < manifold->getNumContacts(); ++i, ++contacts) {
      const btManifoldPoint& p = manifold->getContactPoint(i);
      // The normal lies on the second body and points to the first.
      EXPECT_NEAR(p.m_normalWorldOnB.z(), body_is_first ? 1 : -1, 0.05);
      EXPECT_NEAR(p.m_normalWorldOnB.length(), 1, 1e-4);
      EXPECT_NEAR(p.getDistance(), 0, 0.001);
      EXPECT_NEAR(p.getPositionWorldOnA().z(), 0, 0.002);
      EXPECT_NEAR(p.getPositionWorldOnB().z(), 0, 0.002);
      const btVector3 gap = p.getPositionWorldOnA() - p.getPositionWorldOnB();
      EXPECT_NEAR(gap.dot(p.m_normalWorldOnB), p.getDistance(), 1e-5);
      // Bullet's default would be some centimetres.
      EXPECT_NEAR(manifold->getContactBreakingThreshold(), 0.0004, 1e-5);
    }
  }
  EXPECT_GE(contacts, 3);
}

std::string ground_name(const testing::TestParamInfo<std::tuple<RestGround, bool>>& test) {
  constexpr const char* kNames[] = {"box", "sphere", "plane", "vps"};
  const auto [ground, ground_first] = test.param;
  return std::string(kNames[static_cast<std::size_t>(ground)]) + (ground_first ? "_ground_first" : "_body_first");
}
INSTANTIATE_TEST_SUITE_P(All, Rest,
                         testing::Combine(testing::Values(RestGround::box, RestGround::sphere, RestGround::plane,
                                                          RestGround::vps),
                                          testing::Bool()),
                         ground_name);

TEST(ContactAlgorithm, TheOrderOfInsertionDoesNotChangeTheMotion) {
  btVector3 ends[2];
  for (const bool floor_first : {false, true}) {
    World scene;
    bullet::Shape shape(ball());
    btBoxShape box({1, 1, btScalar(0.5)});
    if (floor_first) scene.add(box, 0, {0, 0, btScalar(-0.5)});
    btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.1)});
    body.setLinearVelocity({btScalar(0.2), 0, 0});
    if (!floor_first) scene.add(box, 0, {0, 0, btScalar(-0.5)});
    scene.step(60);
    ends[floor_first] = body.getWorldTransform().getOrigin();
  }
  EXPECT_NEAR(ends[0].x(), ends[1].x(), 1e-4);
  EXPECT_NEAR(ends[0].z(), ends[1].z(), 1e-4);
}

TEST(ContactAlgorithm, MovingConcaveBodiesCollide) {
  // Two rings on crossing axes, linked: the upper one hangs on the fixed one instead of falling through.
  World scene;
  bullet::Shape shape(torus());
  scene.add(shape, 0, {0, 0, 0});
  btRigidBody& hanging = scene.add(shape, 1, {btScalar(0.1), 0, 0});
  hanging.setWorldTransform(btTransform(btQuaternion(btVector3(1, 0, 0), SIMD_HALF_PI), {btScalar(0.1), 0, 0}));
  scene.step(720);
  EXPECT_EQ(shape.status(), Status::ok);
  EXPECT_GT(hanging.getWorldTransform().getOrigin().z(), -0.08);
  EXPECT_LT(hanging.getWorldTransform().getOrigin().z(), -0.02);
  EXPECT_LT(speed(hanging), 0.3);
}

TEST(ContactAlgorithm, TwoDynamicBodiesExchangeMomentum) {
  World scene;
  scene.world.setGravity({0, 0, 0});
  bullet::Shape shape(ball());
  btRigidBody& left = scene.add(shape, 1, {btScalar(-0.08), 0, 0});
  btRigidBody& right = scene.add(shape, 1, {btScalar(0.08), 0, 0});
  left.setLinearVelocity({btScalar(0.5), 0, 0});
  left.setRestitution(1);
  right.setRestitution(1);
  scene.step(240);
  EXPECT_NEAR(left.getLinearVelocity().x() + right.getLinearVelocity().x(), 0.5, 1e-4);
  EXPECT_GT(right.getLinearVelocity().x(), 0.4);
  EXPECT_GT(right.getWorldTransform().getOrigin().x() - left.getWorldTransform().getOrigin().x(), 0.099);
}

TEST(ContactAlgorithm, SegmentsGiveSeveralManifoldsAndHoldTheBody) {
  World scene;
  bullet::Shape shape(brick());
  shape.set_segments(16);
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.052)});
  scene.step(480);
  EXPECT_GE(count_single_contacts(scene), 3);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.01);
}

TEST(ContactAlgorithm, ImpulsesSurviveFromStepToStep) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  scene.add(shape, 1, {0, 0, btScalar(0.0501)});
  scene.step(240);
  scene.world.performDiscreteCollisionDetection();  // new contact points, before the solver
  double carried = 0;
  int oldest = 0;
  for (const btManifoldPoint& p : scene.points()) {
    carried += double(p.m_appliedImpulse);
    oldest = std::max(oldest, p.m_lifeTime);
  }
  EXPECT_NEAR(carried, 9.81 / 240, 0.3 * 9.81 / 240);
  EXPECT_GT(oldest, 10);
}

// With split impulses: by velocity the brick hops 46 mm, as a fifth of the overlap is resolved in a millisecond.
TEST(ContactAlgorithm, AnInitialOverlapIsResolvedWithoutAHop) {
  World scene;
  scene.split_from(5e-6);
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.045)});
  double highest = 0;
  for (int i = 0; i < 1000; ++i) {
    scene.step(1, btScalar(0.001));
    highest = std::max(highest, double(body.getWorldTransform().getOrigin().z()));
  }
  EXPECT_LT(highest, 0.051);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
}

TEST(ContactAlgorithm, AFoundationYieldsByWeightOverAreaWhateverTheSampling) {
  // A weight of 9.81 N on 0.01 m^2 sinks in by 1 mm, on a box, a baked slab and triangles.
  const PenaltyLaw law{9.81 / (0.01 * 0.001), 2e4};
  const bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
  btBoxShape box({1, 1, btScalar(0.1)});
  Ground sheet(Kind::bvh, 0.5, 20);
  for (const double voxel : {0.003, 0.006}) {
    bullet::Shape shape(baked_at(make_box({0.05, 0.05, 0.05}), voxel));
    ASSERT_EQ(shape.set_foundation(law), Status::ok);
    for (btCollisionShape* const ground :
         {static_cast<btCollisionShape*>(&box), static_cast<btCollisionShape*>(const_cast<bullet::Shape*>(&slab)),
          static_cast<btCollisionShape*>(&*sheet)}) {
      World scene;
      scene.world.getSolverInfo().m_splitImpulse = 0;
      scene.add(*ground, 0, {0, 0, btScalar(ground == &*sheet ? 0 : -0.1)});
      btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.0501)});
      scene.step(480);
      EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.049, 1e-4) << voxel << ' ' << ground->getName();
      EXPECT_LT(speed(body), 0.005);
    }
  }
  bullet::Shape shape(brick());
  EXPECT_EQ(shape.set_foundation({-1, 0}), Status::bad_argument);
  EXPECT_EQ(shape.foundation().stiffness, 0);
}

TEST(ContactAlgorithm, SegmentsStayRigidWhateverTheFoundation) {
  World scene;
  bullet::Shape shape(brick());
  shape.set_segments(16);
  ASSERT_EQ(shape.set_foundation({1e6, 0}), Status::ok);
  btStaticPlaneShape plane({0, 0, 1}, 0);
  scene.add(plane, 0, {0, 0, 0});
  scene.add(shape, 1, {0, 0, btScalar(0.05)});
  scene.step(1);
  ASSERT_FALSE(scene.points().empty());
  for (const btManifoldPoint& p : scene.points()) {
    EXPECT_EQ(p.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING, 0);
  }
}

TEST(ContactAlgorithm, ManifoldsAreGivenBackWhenABodyLeaves) {
  World scene;
  bullet::Shape shape(brick());
  shape.set_segments(16);
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  scene.add(shape, 1, {0, 0, btScalar(0.05)});
  scene.step(30);
  EXPECT_GT(scene.dispatcher.getNumManifolds(), 0);
  scene.world.removeRigidBody(scene.bodies.back().get());
  scene.bodies.pop_back();
  EXPECT_EQ(scene.dispatcher.getNumManifolds(), 0);
}

TEST(ContactAlgorithm, ContactTestsSeeThePairInEitherOrder) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btRigidBody& floor = scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.049)});
  for (const bool body_first : {true, false}) {
    CollectContacts found;
    body_first ? scene.world.contactPairTest(&body, &floor, found) : scene.world.contactPairTest(&floor, &body, found);
    ASSERT_GE(found.points.size(), 3U);
    for (const btManifoldPoint& p : found.points) EXPECT_NEAR(p.getDistance(), -0.001, 1e-5);
  }
  CollectContacts all;
  scene.world.contactTest(&body, all);
  EXPECT_GE(all.points.size(), 3U);
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.5)}));
  CollectContacts none;
  scene.world.contactPairTest(&body, &floor, none);
  EXPECT_TRUE(none.points.empty());
  EXPECT_EQ(scene.dispatcher.getNumManifolds(), 0);  // contactPairTest leaves no manifold
}

TEST(ContactAlgorithm, ChildrenOfCompoundsCollideWhereTheyAre) {
  World scene;
  bullet::Shape shape(ball());
  btCompoundShape dumbbell;
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
  btCompoundShape ground;
  btBoxShape box({1, 1, btScalar(0.5)});
  ground.addChildShape(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(-0.5)}), &box);
  scene.add(ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(dumbbell, 1, {0, 0, btScalar(0.06)});
  scene.step(480);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  double left = 0;
  double right = 0;
  for (const btManifoldPoint& p : scene.points()) {
    left = std::min(left, double(p.getPositionWorldOnA().x()));
    right = std::max(right, double(p.getPositionWorldOnA().x()));
  }
  EXPECT_LT(left, -0.09);
  EXPECT_GT(right, 0.09);
}

TEST(ContactAlgorithm, GhostObjectsSeeTheirOverlaps) {
  World scene;
  btGhostPairCallback callback;
  scene.world.getPairCache()->setInternalGhostPairCallback(&callback);
  bullet::Shape shape(ball());
  btPairCachingGhostObject ghost;
  btBoxShape box({btScalar(0.2), btScalar(0.2), btScalar(0.2)});
  ghost.setCollisionShape(&box);
  ghost.setCollisionFlags(btCollisionObject::CF_NO_CONTACT_RESPONSE);
  scene.world.addCollisionObject(&ghost, btBroadphaseProxy::SensorTrigger, btBroadphaseProxy::AllFilter);
  scene.world.setGravity({0, 0, 0});
  scene.add(shape, 1, {0, 0, btScalar(0.23)});
  scene.step(1);
  ASSERT_EQ(ghost.getNumOverlappingObjects(), 1);
  btManifoldArray manifolds;
  btBroadphasePair& pair = ghost.getOverlappingPairCache()->getOverlappingPairArray()[0];
  btBroadphasePair* const found = scene.world.getPairCache()->findPair(pair.m_pProxy0, pair.m_pProxy1);
  ASSERT_NE(found, nullptr);
  ASSERT_NE(found->m_algorithm, nullptr);
  found->m_algorithm->getAllContactManifolds(manifolds);
  ASSERT_EQ(manifolds.size(), 1);
  EXPECT_GT(manifolds[0]->getNumContacts(), 0);
  scene.world.removeCollisionObject(&ghost);
}

TEST(ContactAlgorithm, APairThatLacksAPartSaysSo) {
  bake::BakeOptions options;
  options.voxel_size = 0.005;
  options.voxelmap = false;
  const auto shell_only = baked(make_sphere(0.05, 3), options);
  World scene;
  bullet::Shape a(shell_only);
  bullet::Shape b(shell_only);
  scene.add(a, 1, {0, 0, 0});
  scene.add(b, 1, {0, 0, btScalar(0.06)});
  scene.step(1);
  EXPECT_EQ(a.status(), Status::missing_part);
  EXPECT_EQ(b.status(), Status::missing_part);
  // Against Bullet's own shapes a pointshell suffices; a voxelmap alone does not.
  options.voxelmap = true;
  options.pointshell = false;
  bullet::Shape map_only(baked(make_sphere(0.05, 3), options));
  World other;
  btBoxShape box({1, 1, btScalar(0.5)});
  other.add(box, 0, {0, 0, btScalar(-0.5)});
  other.add(map_only, 1, {0, 0, btScalar(0.04)});
  other.step(1);
  EXPECT_EQ(map_only.status(), Status::missing_part);
}

TEST(ContactAlgorithm, APoseThatIsNotANumberIsReportedNotFollowed) {
  World scene;
  bullet::Shape shape(ball());
  btBoxShape box({1, 1, btScalar(0.5)});
  btRigidBody& floor = scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.05)});
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, std::numeric_limits<btScalar>::quiet_NaN()}));
  CollectContacts found;
  scene.world.contactPairTest(&body, &floor, found);
  EXPECT_TRUE(found.points.empty());
  EXPECT_EQ(shape.status(), Status::bad_pose);
  body.setWorldTransform(btTransform::getIdentity());
}

// In a step a body falls 2.7 mm, more than a voxel. While it lies still, it needs no contacts ahead in all its
// segments.
TEST(ContactAlgorithm, ABodyOfFineVoxelsLiesOnFourContacts) {
  bullet::Shape shape(baked_at(make_box({0.05, 0.05, 0.05}), 0.002));
  btBoxShape box({1, 1, btScalar(0.5)});
  World scene;
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.06)});
  scene.step(120, btScalar(1.0 / 60));
  for (int i = 0; i < 60; ++i) {
    scene.step(1, btScalar(1.0 / 60));
    ASSERT_EQ(scene.points().size(), 4U) << i;
  }
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.0002);
  // A blow is met by contacts ahead at once.
  body.setLinearVelocity({0, 0, -1});
  scene.world.performDiscreteCollisionDetection();
  EXPECT_GT(scene.points().size(), 4U);
}

TEST(ContactAlgorithm, WorldsInSeveralThreadsShareAShape) {
  bullet::Shape shape(ball());
  btScalar heights[4];
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      World scene;
      btBoxShape box({1, 1, btScalar(0.5)});
      scene.add(box, 0, {0, 0, btScalar(-0.5)});
      btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.2)});
      scene.step(200);
      heights[t] = body.getWorldTransform().getOrigin().z();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const btScalar height : heights) EXPECT_EQ(height, heights[0]);
}

// A kilometre in single precision, a million kilometres in double.
TEST(ContactAlgorithm, FarFromTheOriginBodiesStillRest) {
  const auto far = btScalar(std::is_same_v<btScalar, float> ? 1 << 10 : 1 << 30);
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  scene.add(box, 0, {far, far, btScalar(-0.5)});
  btRigidBody& body = scene.add(shape, 1, {far, far, btScalar(0.06)});
  scene.step(480);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
}

// Contacts ahead would take the bounce from bodies whose restitutions the program combines to more than 0, and bodies
// whose restitutions it does not want need them.
TEST(ContactAlgorithm, BodiesBounceAsTheProgramCombinesTheirRestitutions) {
  struct Drop {
    double first_apex = 0;  // above the ground. [m]
    double deepest = 0;     // [m]
  };
  const auto drop = [](btCollisionShape& shape, btScalar of_ground, btScalar step) {
    World scene;
    btBoxShape ground({1, 1, btScalar(0.5)});
    scene.add(ground, 0, {0, 0, btScalar(-0.5)}).setRestitution(of_ground);
    btRigidBody& body = scene.add(shape, btScalar(0.1), {0, 0, btScalar(0.35)});
    body.setRestitution(btScalar(0.8));
    Drop out;
    bool has_risen = false;
    for (btScalar time = 0; time < 1; time += step) {
      scene.step(1, step);
      const double height = double(body.getWorldTransform().getOrigin().z()) - 0.05;
      has_risen = has_risen || body.getLinearVelocity().z() > 0;
      out.deepest = std::max(out.deepest, -height);
      if (has_risen) out.first_apex = std::max(out.first_apex, height);
    }
    return out;
  };
  bullet::Shape baked_ball(ball());
  btSphereShape sphere(btScalar(0.05));
  const CalculateCombinedCallback usual = gCalculateCombinedRestitutionCallback;
  gCalculateCombinedRestitutionCallback = [](const btCollisionObject* a, const btCollisionObject* b) {
    return std::max(a->getRestitution(), b->getRestitution());
  };
  const btScalar step = btScalar(1.0 / 240);
  EXPECT_NEAR(drop(baked_ball, 0, step).first_apex, drop(sphere, 0, step).first_apex, 0.02);
  gCalculateCombinedRestitutionCallback = [](const btCollisionObject*, const btCollisionObject*) {
    return btScalar(0);
  };
  EXPECT_LT(drop(baked_ball, btScalar(0.5), btScalar(1.0 / 60)).deepest, 0.003);
  gCalculateCombinedRestitutionCallback = usual;
}

}  // namespace
}  // namespace vps::test

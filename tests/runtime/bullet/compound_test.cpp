// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes in compounds, and compounds that Shapes meet.
#include <BulletCollision/CollisionDispatch/btCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

// A shape, by itself or as part of a compound that is as large.
class Wrapped {
 public:
  Wrapped(btCollisionShape& shape, const std::string& how) : tree_(how != "without a tree"), whole_(&shape) {
    if (how == "plain") return;
    add_to(inner_);
    if (how == "nested") add_to(outer_);
  }
  [[nodiscard]] btCollisionShape& shape() { return *whole_; }

 private:
  void add_to(std::unique_ptr<btCompoundShape>& compound) {
    compound = std::make_unique<btCompoundShape>(tree_);
    compound->addChildShape(btTransform::getIdentity(), whole_);
    whole_ = compound.get();
  }

  bool tree_;
  std::unique_ptr<btCompoundShape> inner_, outer_;
  btCollisionShape* whole_;
};

// The lowest height of a fast brick that meets a plate of two voxels. [m]
double lowest(btCollisionShape& plate, const std::string& plate_is, const std::string& brick_is) {
  World scene;
  bullet::Shape shape(brick());
  Wrapped ground(plate, plate_is);
  Wrapped part(shape, brick_is);
  scene.add(ground.shape(), 0, {0, 0, btScalar(-0.004)});
  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  btRigidBody& body = scene.add(part.shape(), 1, {0, 0, btScalar(0.21)});
  body.setMassProps(1, inertia);
  body.updateInertiaTensor();
  body.setLinearVelocity({0, 0, -30});
  double least = 1;
  for (int i = 0; i < 20; ++i) {
    scene.step(1, btScalar(1.0 / 60));
    least = std::min(least, double(body.getWorldTransform().getOrigin().z()));
  }
  return least;
}

TEST(Compound, AFastBodyStopsAtThinChildrenAndAsAChild) {
  btBoxShape box({1, 1, btScalar(0.004)});
  bullet::Shape baked(baked_at(make_box({0.3, 0.3, 0.004}), 0.004));
  for (btCollisionShape* const plate : std::initializer_list<btCollisionShape*>{&box, &baked}) {
    const double plain = lowest(*plate, "plain", "plain");
    EXPECT_GT(plain, 0.045);
    for (const std::string plate_is : {"plain", "child", "without a tree", "nested"}) {
      for (const std::string brick_is : {"plain", "child", "without a tree", "nested"}) {
        EXPECT_NEAR(lowest(*plate, plate_is, brick_is), plain, 1e-5) << plate_is << ", " << brick_is;
      }
    }
  }
}

TEST(Compound, PointsNameTheChildThatTheyAreOn) {
  bullet::Shape baked(brick());
  btBoxShape box({btScalar(0.05), btScalar(0.05), btScalar(0.05)});
  bullet::Shape plate(baked_at(make_box({0.3, 0.3, 0.02}), 0.008));
  for (btCollisionShape* const child : std::initializer_list<btCollisionShape*>{&baked, &box}) {
    World scene;
    btCompoundShape three;
    for (const double at : {-0.15, 0.0, 0.15}) {
      three.addChildShape(btTransform(btMatrix3x3::getIdentity(), {btScalar(at), 0, 0}), child);
    }
    btRigidBody& ground = scene.add(plate, 0, {0, 0, btScalar(-0.02)});
    btRigidBody& body = scene.add(three, 1, {0, 0, btScalar(0.0495)});
    scene.world.performDiscreteCollisionDetection();
    std::set<int> of_compound;
    std::set<int> of_ground;
    for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold& manifold = *scene.dispatcher.getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold.getNumContacts(); ++i) {
        const btManifoldPoint& p = manifold.getContactPoint(i);
        const bool is_first = manifold.getBody0() == &body;
        ASSERT_EQ(is_first ? manifold.getBody1() : manifold.getBody0(), &ground);
        of_compound.insert(is_first ? p.m_index0 : p.m_index1);
        of_ground.insert(is_first ? p.m_index1 : p.m_index0);
        const double x = body.getWorldTransform().invXform(p.getPositionWorldOnA()).x();
        EXPECT_NEAR(x, 0.15 * ((is_first ? p.m_index0 : p.m_index1) - 1), 0.06);
      }
    }
    EXPECT_EQ(of_compound, (std::set<int>{0, 1, 2}));
    EXPECT_EQ(of_ground, std::set<int>{-1});
  }
}

// A manifold's threshold grows with the whole compound: contacts with the sides of boxes would be found far ahead.
TEST(Compound, BulletsOwnChildrenFlyOverJointsAsBulletLetsThem) {
  World scene;
  bullet::Shape shape(brick());
  btSphereShape ball(btScalar(0.05));
  btBoxShape tile({btScalar(0.1), btScalar(0.1), btScalar(0.1)});
  scene.world.setGravity({0, 0, 0});
  for (int i = 0; i < 20; ++i) scene.add(tile, 0, {btScalar(0.2) * btScalar(i), 0, btScalar(-0.1)});
  btCompoundShape compound;
  compound.addChildShape(btTransform::getIdentity(), &ball);
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), {0, 0, 3}), &shape);
  btRigidBody& body = scene.add(compound, 1, {btScalar(0.03), 0, btScalar(0.051)});
  body.setLinearVelocity({30, 0, 0});
  scene.step(20);
  EXPECT_EQ(body.getLinearVelocity().x(), 30);
  EXPECT_EQ(body.getLinearVelocity().z(), 0);
}

TEST(Compound, ContactTestsDoNotLookAhead) {
  for (const std::string brick_is : {"plain", "child"}) {
    World scene;
    bullet::Shape shape(brick());
    btBoxShape box({1, 1, btScalar(0.5)});
    Wrapped part(shape, brick_is);
    btRigidBody& floor = scene.add(box, 0, {0, 0, btScalar(-0.5)});
    btRigidBody& body = scene.add(part.shape(), 1, {0, 0, btScalar(0.055)});
    body.setLinearVelocity({0, 0, -30});
    scene.world.getDispatchInfo().m_timeStep = btScalar(1.0 / 60);
    CollectContacts ahead;
    scene.world.contactPairTest(&body, &floor, ahead);
    EXPECT_EQ(ahead.points.size(), 0U) << brick_is;
    body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.049)}));
    CollectContacts touching;
    scene.world.contactPairTest(&body, &floor, touching);
    EXPECT_GE(touching.points.size(), 3U) << brick_is;
  }
}

TEST(Compound, ChildrenComeAndGo) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, btScalar(0.5)});
  btCompoundShape compound;
  const auto at = [](double x) { return btTransform(btQuaternion::getIdentity(), {btScalar(x), 0, 0}); };
  compound.addChildShape(at(-0.2), &shape);
  scene.add(box, 0, {0, 0, btScalar(-0.5)});
  scene.add(compound, 1, {0, 0, btScalar(0.05)}).setGravity({0, 0, 0});
  const auto touches_at = [&](double x) {
    scene.step(1);
    const auto points = scene.points();
    return std::any_of(points.begin(), points.end(), [&](const btManifoldPoint& p) {
      return std::abs(double(p.getPositionWorldOnA().x()) - x) < 0.1;
    });
  };
  EXPECT_TRUE(touches_at(-0.2));
  compound.addChildShape(at(0.2), &shape);
  EXPECT_TRUE(touches_at(0.2));
  EXPECT_TRUE(touches_at(-0.2));
  compound.removeChildShapeByIndex(0);
  EXPECT_TRUE(touches_at(0.2));
  EXPECT_FALSE(touches_at(-0.2));
  compound.updateChildTransform(0, btTransform(btQuaternion::getIdentity(), {0, 0, 1}));
  scene.step(1);
  EXPECT_EQ(scene.dispatcher.getNumManifolds(), 0);
}

bool refuses_all(const btCollisionShape*, const btCollisionShape*) {
  return false;
}

TEST(Compound, TheProgramsCallbacksAreAsked) {
  for (const bool both : {false, true}) {
    World scene;
    bullet::Shape shape(brick());
    btBoxShape box({1, 1, btScalar(0.5)});
    Wrapped part(shape, "child");
    Wrapped ground(box, both ? "child" : "plain");
    scene.add(ground.shape(), 0, {0, 0, btScalar(-0.5)});
    scene.add(part.shape(), 1, {0, 0, btScalar(0.05)});
    scene.step(1);
    EXPECT_FALSE(scene.points().empty());
    btShapePairCallback& callback = both ? gCompoundCompoundChildShapePairCallback : gCompoundChildShapePairCallback;
    callback = refuses_all;
    scene.step(1);
    callback = nullptr;
    EXPECT_TRUE(scene.points().empty());
  }
}

int asked = 0;
bool counts(const btCollisionShape*, const btCollisionShape*) {
  ++asked;
  return true;
}

// In a step the brick flies over twenty tiles of a row.
TEST(Compound, OnlyChildrenAlongTheWayAreAsked) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape tile({btScalar(0.125), btScalar(0.125), btScalar(0.1)});
  btCompoundShape level;
  for (int i = -20; i <= 20; ++i) {
    for (int k = -20; k <= 20; ++k) {
      const btVector3 at(btScalar(0.25) * btScalar(i), btScalar(0.25) * btScalar(k), btScalar(-0.1));
      level.addChildShape(btTransform(btQuaternion::getIdentity(), at), &tile);
    }
  }
  scene.add(level, 0, {0, 0, 0});
  scene.add(shape, 1, {0, 0, btScalar(0.06)}).setLinearVelocity({300, 0, 0});
  asked = 0;
  gCompoundChildShapePairCallback = counts;
  scene.step(1, btScalar(1.0 / 60));
  gCompoundChildShapePairCallback = nullptr;
  EXPECT_GE(asked, 20);
  EXPECT_LE(asked, 70);
}

TEST(Compound, WithoutAShapeItIsBulletsOwn) {
  World scene;
  bullet::Shape shape(brick());
  btBoxShape box({1, 1, 1});
  btCompoundShape boxes;
  btCompoundShape mixed;
  for (btCompoundShape* const compound : {&boxes, &mixed}) compound->addChildShape(btTransform::getIdentity(), &box);
  mixed.addChildShape(btTransform::getIdentity(), &shape);
  const auto is_own = [&](const btCollisionShape& first, const btCollisionShape& second) {
    btCollisionObject object;
    const btTransform pose = btTransform::getIdentity();
    const btCollisionObjectWrapper a(nullptr, &first, &object, pose, -1, -1);
    const btCollisionObjectWrapper b(nullptr, &second, &object, pose, -1, -1);
    for (const auto kind : {BT_CONTACT_POINT_ALGORITHMS, BT_CLOSEST_POINT_ALGORITHMS}) {
      btCollisionAlgorithm* const found = scene.dispatcher.findAlgorithm(&a, &b, nullptr, kind);
      const bool is_bullets = dynamic_cast<btCompoundCollisionAlgorithm*>(found) != nullptr;
      found->~btCollisionAlgorithm();
      scene.dispatcher.freeCollisionAlgorithm(found);
      if (!is_bullets) return false;
    }
    return true;
  };
  EXPECT_TRUE(is_own(boxes, box));
  EXPECT_TRUE(is_own(box, boxes));
  EXPECT_TRUE(is_own(boxes, boxes));
  EXPECT_FALSE(is_own(mixed, box));
  EXPECT_FALSE(is_own(boxes, mixed));
  EXPECT_FALSE(is_own(shape, boxes));
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Worlds written by Bullet's serializer and read by its importer.
#include <BulletWorldImporter/btBulletWorldImporter.h>
#include <LinearMath/btSerializer.h>
#include <gtest/gtest.h>

#include "tests/runtime/bullet/world.h"
#include "tests/support/poses.h"

namespace vps::test {
namespace {

// The bytes of a .bullet file.
std::vector<char> written(btDiscreteDynamicsWorld& world) {
  btDefaultSerializer serializer;
  world.serialize(&serializer);
  const auto* const bytes = reinterpret_cast<const char*>(serializer.getBufferPointer());
  return {bytes, bytes + serializer.getCurrentBufferSize()};
}

TEST(Serialize, ShapesComeBackFromABulletFile) {
  Pose turn;
  turn.rotation[0] = turn.rotation[4] = std::cos(0.4);
  turn.rotation[1] = -std::sin(0.4);
  turn.rotation[3] = std::sin(0.4);
  const TriangleMesh mesh = moved(turn, make_box({0.05, 0.04, 0.03}));
  const auto asset = baked_at(mesh, 0.004);
  std::vector<char> file;
  btVector3 end;
  btVector3 inertia;
  {
    World scene;
    bullet::Shape shape(asset, bullet::Part::mixed, bullet::Axes::principal);
    shape.setLocalScaling({btScalar(1.5), btScalar(1.5), btScalar(1.5)});
    shape.set_name("brick");
    btBoxShape box({1, 1, btScalar(0.5)});
    btCompoundShape pair;
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
    pair.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
    scene.add(box, 0, {0, 0, btScalar(-0.5)});
    scene.add(shape, 1, {btScalar(0.5), 0, btScalar(0.06)});
    scene.add(pair, 1, {btScalar(-0.5), 0, btScalar(0.06)});
    scene.add(pair, 1, {0, btScalar(-0.5), btScalar(0.06)});
    file = written(scene.world);
    scene.step(240);
    end = scene.bodies[1]->getWorldTransform().getOrigin();
    inertia = scene.bodies[1]->getLocalInertia();
  }

  World loaded;
  btBulletWorldImporter importer(&loaded.world);
  ASSERT_TRUE(importer.loadFileFromMemory(file.data(), static_cast<int>(file.size())));
  ASSERT_EQ(loaded.world.getNumCollisionObjects(), 4);
  bullet::Shape shape(asset, bullet::Part::mixed, bullet::Axes::principal);
  // A Shape in other axes or of another size has another box.
  bullet::Shape plain(asset);
  bullet::Shape* others_of_asset[] = {&plain, &shape};
  plain.setLocalScaling({btScalar(1.5), btScalar(1.5), btScalar(1.5)});
  EXPECT_EQ(bullet::reattach(loaded.world, others_of_asset), 0);
  shape.setLocalScaling({btScalar(1.5), btScalar(1.5), btScalar(1.5)});
  EXPECT_EQ(std::string(importer.getNameForPointer(loaded.world.getCollisionObjectArray()[1]->getCollisionShape())),
            bullet::asset_key(*asset) + " brick");
  // A Shape of another asset replaces no box.
  bullet::Shape other(baked_at(mesh, 0.005), bullet::Part::mixed, bullet::Axes::principal);
  bullet::Shape* others[] = {&other};
  EXPECT_EQ(bullet::reattach(loaded.world, others), 0);
  bullet::Shape* shapes[] = {&other, &shape};
  loaded.step(1);
  const btBroadphasePairArray& pairs = loaded.world.getPairCache()->getOverlappingPairArray();
  ASSERT_GE(pairs.size(), 3);
  const int count = bullet::reattach(loaded.world, shapes);
  EXPECT_EQ(count, 3);  // one of a body, two of children that bodies share
  // Their algorithms were made for boxes.
  for (int i = 0; i < pairs.size(); ++i) EXPECT_EQ(pairs[i].m_algorithm, nullptr);
  for (int i = 0; i < 4; ++i) {
    loaded.world.getCollisionObjectArray()[i]->setActivationState(DISABLE_DEACTIVATION);
  }
  loaded.step(240);
  const btCollisionObject* const body = loaded.world.getCollisionObjectArray()[1];
  EXPECT_EQ(body->getCollisionShape(), &shape);
  EXPECT_EQ(btRigidBody::upcast(body)->getLocalInertia(), inertia);
  EXPECT_LT((body->getWorldTransform().getOrigin() - end).length(), 1e-3);
  for (const int i : {2, 3})
    EXPECT_NEAR(loaded.world.getCollisionObjectArray()[i]->getWorldTransform().getOrigin().z(), 0.045, 1e-3) << i;
  importer.deleteAllData();
}

TEST(Serialize, TheKeyIsThatOfTheContents) {
  const auto one = baked_at(make_box({0.05, 0.04, 0.03}), 0.004);
  const auto same = baked_at(make_box({0.05, 0.04, 0.03}), 0.004);
  const auto other = baked_at(make_box({0.05, 0.04, 0.03}), 0.005);
  EXPECT_EQ(bullet::asset_key(*one), bullet::asset_key(*same));
  EXPECT_NE(bullet::asset_key(*one), bullet::asset_key(*other));
  EXPECT_EQ(bullet::asset_key(*one).size(), 20U);
  bullet::Shape shape(one);
  EXPECT_EQ(shape.label(), bullet::asset_key(*one));
  shape.set_name("brick");
  EXPECT_EQ(shape.label(), bullet::asset_key(*one) + " brick");
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

TEST(Shape, BoundsAndInertiaAreThoseOfTheBody) {
  // The box is off-centre in its own frame: the shape's origin moves to the centre of mass.
  const auto asset = baked_at(make_box({0.05, 0.04, 0.03}, {0.2, 0, -0.1}), 0.005);
  const bullet::Shape shape(asset);
  EXPECT_NEAR(shape.centre_of_mass().x(), 0.2, 1e-6);
  EXPECT_NEAR(shape.centre_of_mass().z(), -0.1, 1e-6);
  btVector3 low, high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  EXPECT_NEAR(low.x(), -0.05, 1e-6);
  EXPECT_NEAR(high.z(), 0.03, 1e-6);
  shape.getAabb(btTransform(btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI), {1, 0, 0}), low, high);
  EXPECT_NEAR(high.x(), 1.04, 1e-5);
  EXPECT_NEAR(high.y(), 0.05, 1e-5);
  btVector3 inertia;
  shape.calculateLocalInertia(2, inertia);
  EXPECT_NEAR(inertia.x(), 2 * (0.08 * 0.08 + 0.06 * 0.06) / 12, 1e-7);
  EXPECT_NEAR(inertia.y(), 2 * (0.1 * 0.1 + 0.06 * 0.06) / 12, 1e-7);
  EXPECT_NEAR(inertia.z(), 2 * (0.1 * 0.1 + 0.08 * 0.08) / 12, 1e-7);
}

// The moments at unit density are below floats.
TEST(Shape, ABodyOfATenthOfANanometreHasInertia) {
  const double edge = 1e-10;
  const bullet::Shape shape(baked_at(make_box({edge / 2, edge / 2, edge / 2}), edge / 10));
  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(double(inertia[axis]) / (edge * edge / 6), 1, 1e-5);
  // Too small for Bullet to invert: such a body does not turn.
  shape.calculateLocalInertia(btScalar(1e-20), inertia);
  EXPECT_TRUE(inertia.isZero());
}

TEST(Shape, SitsInASlotThatBulletTreatsAsConcaveAndCastsNowhere) {
  const bullet::Shape shape(baked_at(make_sphere(0.05, 3), 0.01));
  EXPECT_EQ(shape.getShapeType(), FAST_CONCAVE_MESH_PROXYTYPE);
  EXPECT_NE(shape.getShapeType(), SDF_SHAPE_PROXYTYPE);
  EXPECT_TRUE(shape.isConcave());
}

TEST(Shape, AnotherScalingThanAUniformPositiveOneIsRefusedUntilItIsUndone) {
  bullet::Shape shape(ball());
  shape.setLocalScaling({2, 2, 2});
  EXPECT_EQ(shape.status(), Status::ok);
  const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
  for (const btVector3& refused : {btVector3(2, 1, 1), btVector3(0, 0, 0), btVector3(-1, -1, -1),
                                   btVector3(nan, nan, nan), btVector3(2000, 2000, 2000)}) {
    shape.setLocalScaling(refused);
    EXPECT_EQ(shape.status(), Status::bad_argument);
    EXPECT_TRUE(shape.refuses_scaling());
    EXPECT_EQ(shape.getLocalScaling().x(), 2);
    shape.setLocalScaling({2, 2, 2});
    EXPECT_EQ(shape.status(), Status::ok);
    EXPECT_FALSE(shape.refuses_scaling());
  }
  // What went wrong elsewhere stays.
  shape.report(Status::missing_part);
  shape.setLocalScaling({1, 1, 1});
  EXPECT_EQ(shape.status(), Status::missing_part);
  EXPECT_EQ(shape.info().voxel_size, ball()->info().voxel_size);
}

TEST(Shape, AScaledShapeIsTheOneOfTheScaledMesh) {
  const auto large = baked_at(make_box({0.12, 0.08, 0.06}, {0.4, 0, -0.2}), 0.01);
  const auto small = baked_at(make_box({0.06, 0.04, 0.03}, {0.2, 0, -0.1}), 0.005);
  const bullet::Shape expected(large);
  bullet::Shape shape(small);
  shape.setLocalScaling({2, 2, 2});
  EXPECT_LT((shape.centre_of_mass() - expected.centre_of_mass()).length(), 1e-6);
  btVector3 low[2], high[2], centre[2], inertia[2];
  btScalar radius[2];
  const btTransform at(btQuaternion({1, 2, 3}, 1), {3, 2, 1});
  int k = 0;
  for (const bullet::Shape* one : {&expected, static_cast<const bullet::Shape*>(&shape)}) {
    one->getAabb(at, low[k], high[k]);
    one->getBoundingSphere(centre[k], radius[k]);
    one->calculateLocalInertia(3, inertia[k]);
    ++k;
  }
  EXPECT_LT((low[0] - low[1]).length() + (high[0] - high[1]).length(), 1e-5);
  EXPECT_NEAR(radius[0], radius[1], 1e-6);
  EXPECT_LT((inertia[0] - inertia[1]).length(), 1e-6);
}

// Contacts of one step with a partner, for a body of a shape.
std::vector<btManifoldPoint> contacts_of(btCollisionShape& shape, btCollisionShape& partner, const btVector3& at) {
  World scene;
  scene.world.setGravity({0, 0, 0});
  scene.add(partner, 0, {0, 0, 0});
  scene.add(shape, 1, at);
  scene.world.performDiscreteCollisionDetection();
  std::vector<btManifoldPoint> points = scene.points();
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.getDistance() < b.getDistance(); });
  return points;
}

TEST(Shape, AScaledShapeHasTheContactsOfTheScaledMesh) {
  bullet::Shape large(baked_at(make_sphere(0.1, 4), 0.006));
  bullet::Shape small(ball());
  small.setLocalScaling({2, 2, 2});
  btStaticPlaneShape plane({0, 0, 1}, btScalar(-0.099));
  btSphereShape sphere(btScalar(0.07));
  btBoxShape box({btScalar(0.05), btScalar(0.06), btScalar(0.069)});
  btTriangleMesh triangles;
  triangles.addTriangle({-1, -1, btScalar(-0.099)}, {1, -1, btScalar(-0.099)}, {0, 1, btScalar(-0.099)});
  btBvhTriangleMeshShape sheet(&triangles, true);
  bullet::Shape block(brick());  // scaled itself
  block.setLocalScaling({3, 3, 3});
  const std::pair<btCollisionShape*, btVector3> partners[] = {{&plane, {0, 0, 0}},
                                                              {&sphere, {0, 0, btScalar(0.169)}},
                                                              {&box, {0, 0, btScalar(0.168)}},
                                                              {&sheet, {0, 0, 0}},
                                                              {&block, {0, 0, btScalar(0.249)}}};
  for (const auto& [partner, at] : partners) {
    const auto expected = contacts_of(large, *partner, at);
    const auto found = contacts_of(small, *partner, at);
    ASSERT_FALSE(expected.empty()) << partner->getName();
    ASSERT_FALSE(found.empty()) << partner->getName();
    EXPECT_NEAR(double(found[0].getDistance()), double(expected[0].getDistance()), 6e-4) << partner->getName();
    EXPECT_NEAR(double(found[0].getDistance()), -0.001, 1e-3) << partner->getName();
    EXPECT_GT(found[0].m_normalWorldOnB.dot(expected[0].m_normalWorldOnB), 0.99) << partner->getName();
  }
}

TEST(Shape, ShapesOfOneAssetInThreeSizesRestOnEachOther) {
  World scene;
  scene.world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-0.004);
  scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  btBoxShape floor({1, 1, btScalar(0.5)});
  scene.add(floor, 0, {0, 0, btScalar(-0.5)});
  std::vector<std::unique_ptr<bullet::Shape>> shapes;
  double height = 0;
  for (const double scale : {2.0, 1.0, 0.5}) {
    shapes.push_back(std::make_unique<bullet::Shape>(brick()));
    shapes.back()->setLocalScaling(btVector3(1, 1, 1) * btScalar(scale));
    scene.add(*shapes.back(), btScalar(scale * scale * scale), {0, 0, btScalar(height + 0.0501 * scale)});
    height += 0.1 * scale;
  }
  scene.step(480);
  height = 0;
  std::size_t i = 1;
  for (const double scale : {2.0, 1.0, 0.5}) {
    const btRigidBody& body = *scene.bodies[i++];
    EXPECT_NEAR(double(body.getWorldTransform().getOrigin().z()), height + 0.05 * scale, 1e-3) << scale;
    EXPECT_LT(speed(body), 2e-3) << scale;
    height += 0.1 * scale;
  }
}

TEST(Shape, ABodyMayGrowAtRest) {
  World scene;
  scene.world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-0.008);
  bullet::Shape shape(brick());
  bullet::Shape ground(brick());
  ground.setLocalScaling({4, 4, 4});
  scene.add(ground, 0, {0, 0, btScalar(-0.2)});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.05)});
  scene.step(60);
  for (const double scale : {1.5, 0.7}) {
    shape.setLocalScaling(btVector3(1, 1, 1) * btScalar(scale));
    btVector3 inertia;
    shape.calculateLocalInertia(1, inertia);
    body.setMassProps(1, inertia);
    btTransform at = body.getWorldTransform();
    at.getOrigin().setZ(btScalar(0.05 * scale));
    body.setWorldTransform(at);
    scene.world.updateSingleAabb(&body);
    scene.step(240);
    EXPECT_NEAR(double(body.getWorldTransform().getOrigin().z()), 0.05 * scale, 1e-3) << scale;
    EXPECT_LT(speed(body), 2e-3) << scale;
  }
}

TEST(Shape, ACompoundScalesItsShapes) {
  bullet::Shape shape(brick());
  btCompoundShape compound;
  compound.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
  compound.setLocalScaling({2, 2, 2});
  btVector3 low, high;
  compound.getAabb(btTransform::getIdentity(), low, high);
  EXPECT_NEAR(low.x(), 0.1, 1e-5);
  EXPECT_NEAR(high.x(), 0.3, 1e-5);
  EXPECT_EQ(shape.status(), Status::ok);
}

TEST(Shape, SegmentLevelIsTheOneWithTheNearestNumberOfClusters) {
  bullet::Shape shape(baked_at(make_sphere(0.05, 4), 0.003));
  EXPECT_EQ(shape.segment_level(), 0U);
  shape.set_segments(1);
  EXPECT_EQ(shape.segment_level(), 1U);
  shape.set_segments(1000000);
  EXPECT_EQ(shape.segment_level(), shape.pointshell().levels);
}

}  // namespace
}  // namespace vps::test

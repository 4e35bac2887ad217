// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes that fall, slide and rest on Bullet's triangle meshes.
#include "tests/runtime/bullet/mesh_ground.h"

namespace vps::test {
namespace {

std::string mesh_name(const testing::TestParamInfo<std::tuple<Kind, bool>>& test) {
  constexpr const char* kNames[] = {"bvh", "scaled", "multimaterial", "terrain", "gimpact"};
  const auto [kind, ground_first] = test.param;
  return std::string(kNames[static_cast<std::size_t>(kind)]) + (ground_first ? "_ground_first" : "_body_first");
}
INSTANTIATE_TEST_SUITE_P(All, EveryMesh,
                         testing::Combine(testing::Values(Kind::bvh, Kind::scaled, Kind::multimaterial, Kind::terrain,
                                                          Kind::gimpact),
                                          testing::Bool()),
                         mesh_name);

TEST_P(EveryMesh, ABodyFallsOntoItAndRestsWithSoundContacts) {
  const auto [kind, ground_first] = GetParam();
  const std::shared_ptr<Asset> assets[] = {brick(), ball(), torus(), brick_shell()};
  const double rests_at[] = {0.05, 0.05, 0.03, 0.05};
  for (std::size_t k = 0; k < std::size(assets); ++k) {
    SCOPED_TRACE(k);
    MeshWorld scene;
    bullet::Shape shape(assets[k]);
    Ground ground(kind, 0.5, 20);
    btRigidBody* floor = ground_first ? &scene.add(*ground, 0, {0, 0, 0}) : nullptr;
    btRigidBody& body = scene.add(shape, 1, {btScalar(0.01), btScalar(0.02), btScalar(rests_at[k] + 0.01)});
    if (!ground_first) floor = &scene.add(*ground, 0, {0, 0, 0});
    body.setLinearVelocity({0, 0, -3});
    scene.step(240);
    EXPECT_EQ(shape.status(), Status::ok);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), rests_at[k], 0.001);
    EXPECT_LT(speed(body), k == 1 ? 0.12 : 0.01);  // the ball rolls on, as it does on a plane
    int contacts = 0;
    for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
      const btPersistentManifold* manifold = scene.dispatcher.getManifoldByIndexInternal(m);
      const bool body_is_first = manifold->getBody0() == &body;
      ASSERT_TRUE(body_is_first || manifold->getBody0() == floor);
      for (int i = 0; i < manifold->getNumContacts(); ++i, ++contacts) {
        const btManifoldPoint& p = manifold->getContactPoint(i);
        EXPECT_NEAR(p.m_normalWorldOnB.z(), body_is_first ? 1 : -1, 1e-3);
        EXPECT_NEAR(p.getDistance(), 0, 0.001);
        EXPECT_NEAR(p.getPositionWorldOnA().z(), 0, 0.002);
        const btVector3 gap = p.getPositionWorldOnA() - p.getPositionWorldOnB();
        EXPECT_NEAR(gap.dot(p.m_normalWorldOnB), p.getDistance(), 1e-5);
      }
    }
    EXPECT_GE(contacts, k == 1 ? 1 : 3);
  }
}

TEST(TriangleScenes, AFoundationPressesOnACornerOfTheGroundToo) {
  // The tip is far from the shell's points: its contact is a feature of its own.
  const PenaltyLaw law{1e7, 1e4};
  MeshWorld scene;
  bullet::Shape shape(brick());
  ASSERT_EQ(shape.set_foundation(law), Status::ok);
  btTriangleMesh triangles = to_bullet(pyramid(0.2, 0.2));
  btBvhTriangleMeshShape ground(&triangles, true);
  scene.add(ground, 0, {0, 0, 0});
  scene.add(shape, 1, {btScalar(0.002), btScalar(0.002), btScalar(0.0495)});
  scene.step(1);
  ASSERT_FALSE(scene.points().empty());
  for (const btManifoldPoint& p : scene.points()) {
    EXPECT_GE(static_cast<std::uint32_t>(p.m_partId0), brick()->info().points);
    EXPECT_NE(p.m_contactPointFlags & BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING, 0);
    EXPECT_GT(p.m_combinedContactStiffness1, 0);
  }
}

TEST_P(EveryMesh, ABrickSlidesOverItWithoutAKick) {
  const auto [kind, ground_first] = GetParam();
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(kind, 1, 100);
  if (ground_first) scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, turned({0, 0, 1}, 0.3, {btScalar(-0.4), btScalar(0.003), btScalar(0.0505)}));
  if (!ground_first) scene.add(*ground, 0, {0, 0, 0});
  scene.step(60);
  const double friction = 0.25;  // product of both frictions
  body.setLinearVelocity({btScalar(1.5), 0, 0});
  btVector3 last = body.getLinearVelocity();
  for (int i = 0; i < 120; ++i) {
    scene.step(1);
    const btVector3 now = body.getLinearVelocity();
    EXPECT_NEAR(now.x() - last.x(), -friction * 9.81 / 240, 0.5 * friction * 9.81 / 240) << i;
    EXPECT_NEAR(now.y(), 0, 0.03);
    EXPECT_NEAR(now.z(), 0, 0.03);
    EXPECT_LT(body.getAngularVelocity().length(), 0.5);
    last = now;
  }
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
}

TEST_P(EveryMesh, ABallRollsOverItAsOverAPlaneAndFallsOffItsEnd) {
  const auto [kind, ground_first] = GetParam();
  const double speed = 3;
  for (const int rate : {60, 240}) {
    SCOPED_TRACE(rate);
    MeshWorld scene;
    scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
    bullet::Shape shape(ball());
    Ground ground(kind, 1, 20);
    if (ground_first) scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(shape, 1, {btScalar(-0.9), btScalar(0.03), btScalar(0.05)});
    if (!ground_first) scene.add(*ground, 0, {0, 0, 0});
    body.setLinearVelocity({btScalar(speed), 0, 0});
    body.setAngularVelocity({0, btScalar(speed / 0.05), 0});
    scene.step(rate / 2, btScalar(1.0 / rate));
    EXPECT_NEAR(body.getLinearVelocity().x() / speed, 1, 0.01);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
    scene.step(rate / 2, btScalar(1.0 / rate));
    EXPECT_LT(body.getWorldTransform().getOrigin().z(), -0.1);
  }
}

TEST_P(EveryMesh, ABodyGlidesDownASlopeAsGravityWants) {
  const auto [kind, ground_first] = GetParam();
  const double rise = 0.5;
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(kind, 1, 40, [&](double x, double) { return -rise * x; });
  if (ground_first) scene.add(*ground, 0, {0, 0, 0}).setFriction(0);
  const double angle = std::atan(rise);
  const btTransform start =
      turned({0, 1, 0}, angle, {btScalar(0.0501 * std::sin(angle)), 0, btScalar(0.0501 * std::cos(angle))});
  btRigidBody& body = scene.add(shape, 1, start);
  if (!ground_first) scene.add(*ground, 0, {0, 0, 0}).setFriction(0);
  scene.step(120);
  const double along = 9.81 * std::sin(angle) * 0.5;
  EXPECT_NEAR(body.getLinearVelocity().x(), along * std::cos(angle), 0.03 * along);
  EXPECT_NEAR(body.getLinearVelocity().z(), -along * std::sin(angle), 0.03 * along);
  EXPECT_LT(body.getAngularVelocity().length(), 0.2);
}

TEST_P(EveryMesh, ChildrenOfCompoundsRestOnIt) {
  const auto [kind, ground_first] = GetParam();
  MeshWorld scene;
  bullet::Shape shape(ball());
  btCompoundShape dumbbell;
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
  dumbbell.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
  Ground ground(kind, 0.5, 20);
  btCompoundShape floor;
  floor.addChildShape(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(-0.1)}), &*ground);
  const btVector3 at(0, 0, btScalar(0.1));
  if (ground_first) scene.add(floor, 0, at);
  btRigidBody& body = scene.add(dumbbell, 1, {0, 0, btScalar(0.06)});
  if (!ground_first) scene.add(floor, 0, at);
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.05);
}

TEST(TriangleContacts, ACompoundRestsOnAMeshThatIsNoChild) {
  for (const Kind kind : {Kind::bvh, Kind::terrain, Kind::gimpact}) {
    MeshWorld scene;
    bullet::Shape shape(brick());
    btCompoundShape compound;
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(0.1), 0, 0}), &shape);
    compound.addChildShape(btTransform(btQuaternion::getIdentity(), {btScalar(-0.1), 0, 0}), &shape);
    Ground ground(kind, 0.5, 20);
    scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(compound, 1, {0, 0, btScalar(0.06)});
    scene.step(240);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001) << static_cast<int>(kind);
  }
}

TEST(TriangleContacts, TwoTrianglesAreGroundEnough) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  Ground ground(Kind::bvh, 1000, 1);
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {btScalar(3.003), btScalar(2.9), btScalar(0.06)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.005);
}

TEST(TriangleContacts, ABodyRestsOnABedOfSpikes) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh bed;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      TriangleMesh spike = pyramid(0.0006, 0.01);
      for (auto& v : spike.vertices) {
        v[0] += 0.0207 * i;
        v[1] += 0.0207 * j;
      }
      bed = joined(bed, spike);
    }
  }
  btTriangleMesh triangles = to_bullet(bed);
  btBvhTriangleMeshShape mesh(&triangles, true);
  scene.add(mesh, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.055)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, ABrickRestsAcrossARidge) {
  // The brick rests on two long walls whose edges are sharper than the spacing of the points resolves.
  MeshWorld scene;
  bullet::Shape shape(brick());
  TriangleMesh walls;
  for (const double x : {-0.0313, 0.0291}) {
    TriangleMesh wall;
    wall.vertices = {
        {x, -1, 0},           {x, 1, 0}, {x - 0.004, -1, -0.05}, {x - 0.004, 1, -0.05}, {x + 0.004, -1, -0.05},
        {x + 0.004, 1, -0.05}};
    wall.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}, {1, 4, 5}};
    walls = joined(walls, wall);
  }
  btTriangleMesh triangles = to_bullet(walls);
  btBvhTriangleMeshShape mesh(&triangles, true);
  scene.add(mesh, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.055)});
  scene.step(480);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().x(), 0, 0.002);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, MovingGImpactMeshesFallOnAShapeAndAShapeOnThem) {
  btTriangleMesh triangles = to_bullet(make_box({0.1, 0.1, 0.05}));
  for (const bool shape_moves : {false, true}) {
    MeshWorld scene;
    btGImpactMeshShape mesh(&triangles);
    mesh.updateBound();
    bullet::Shape small(brick());
    bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.1}), 0.01));
    btCollisionShape& below = shape_moves ? static_cast<btCollisionShape&>(mesh) : slab;
    btCollisionShape& above = shape_moves ? static_cast<btCollisionShape&>(small) : mesh;
    scene.add(below, 0, {0, 0, btScalar(shape_moves ? -0.05 : -0.1)});
    btRigidBody& body = scene.add(above, 1, {0, 0, btScalar(0.06)});
    scene.step(480);
    EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001) << shape_moves;
    EXPECT_LT(speed(body), 0.02) << shape_moves;
  }
}

TEST(TriangleContacts, SegmentsKeepTheirDeepestContactEach) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  shape.set_segments(16);
  Ground ground(Kind::bvh, 0.5, 20);
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.052)});
  scene.step(480);
  EXPECT_GE(count_single_contacts(scene), 3);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.05, 0.001);
  EXPECT_LT(speed(body), 0.01);
}

TEST(TriangleContacts, MarginsThickenBoth) {
  MeshWorld scene;
  bullet::Shape shape(brick());
  shape.setMargin(btScalar(0.003));
  Ground ground(Kind::bvh, 0.5, 20);
  (*ground).setMargin(btScalar(0.004));
  scene.add(*ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.06)});
  scene.step(240);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.057, 0.0005);
}

TEST(TriangleContacts, TheSameStepsGiveTheSameBits) {
  btVector3 ends[2];
  for (btVector3& end : ends) {
    MeshWorld scene;
    bullet::Shape shape(torus());
    Ground ground(Kind::gimpact, 0.5, 30,
                  [](double x, double y) { return 0.02 * std::sin(20 * x) * std::cos(17 * y); });
    scene.add(*ground, 0, {0, 0, 0});
    btRigidBody& body = scene.add(shape, 1, turned({1, 0, 0}, 0.7, {0, 0, btScalar(0.2)}));
    scene.step(240);
    end = body.getWorldTransform().getOrigin();
  }
  EXPECT_EQ(ends[0], ends[1]);
}

}  // namespace
}  // namespace vps::test

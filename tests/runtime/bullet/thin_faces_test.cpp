// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies whose faces have few points: the other body's edges and corners are found in their fields.
#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

std::shared_ptr<Asset> thinned(const TriangleMesh& mesh, double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  options.thin_faces = 4;
  return baked(mesh, options);
}

// A cube comes down on one of its corners, between the points of the slab's face. It does not turn.
btScalar depth_of_corner(std::shared_ptr<Asset> slab, std::shared_ptr<Asset> cube, const btVector3& at) {
  World scene;
  bullet::Shape ground(std::move(slab));
  bullet::Shape shape(std::move(cube));
  scene.add(ground, 0, {0, 0, btScalar(-0.02)});
  const btScalar corner = btScalar(0.01) * btSqrt(3);
  btRigidBody& body = scene.add(shape, 1, at + btVector3(0, 0, corner + btScalar(0.002)));
  const btQuaternion on_corner = shortestArcQuat(btVector3(1, 1, 1).normalized(), btVector3(0, 0, -1));
  body.setWorldTransform(btTransform(on_corner, body.getWorldTransform().getOrigin()));
  body.setAngularFactor(0);
  scene.step(240);
  EXPECT_EQ(shape.status(), Status::ok);
  EXPECT_LT(speed(body), 0.01);
  return corner - body.getWorldTransform().getOrigin().z();
}

TEST(ThinFaces, ACornerIsFoundBetweenThePointsOfAFace) {
  constexpr double kVoxel = 0.001;
  // The slab has the finer voxels, and so gives the pointshell.
  const auto slab = thinned(make_box({0.05, 0.05, 0.02}), kVoxel);
  const auto cube = thinned(make_box({0.01, 0.01, 0.01}), 1.3 * kVoxel);
  for (const btScalar x : {btScalar(0), btScalar(0.0013), btScalar(0.0026), btScalar(0.0039)}) {
    for (const btScalar y : {btScalar(0), btScalar(0.0017), btScalar(0.0031)}) {
      EXPECT_NEAR(depth_of_corner(slab, cube, {x, y, 0}), 0, 0.3 * kVoxel) << x << " " << y;
    }
  }
}

// Two cubes on each other and on a slab, each where its edges lie elsewhere on the other's face.
TEST(ThinFaces, AFaceRestsOnAFace) {
  for (const double shift : {0.0, 0.0006, 0.0013, 0.0022}) {
    World scene;
    bullet::Shape ground(thinned(make_box({0.05, 0.05, 0.02}), 0.001));
    bullet::Shape shape(thinned(make_box({0.02, 0.02, 0.02}), 0.001));
    scene.add(ground, 0, {0, 0, btScalar(-0.02)});
    btRigidBody& lower = scene.add(shape, 1, {btScalar(shift), 0, btScalar(0.0205)});
    btRigidBody& upper = scene.add(shape, 1, {btScalar(0.003 + 2 * shift), btScalar(0.002), btScalar(0.061)});
    scene.step(480);
    double fastest = 0;
    for (int i = 0; i < 240; ++i) {
      scene.step(1);
      fastest = std::max(fastest, speed(lower) + speed(upper));
    }
    EXPECT_NEAR(lower.getWorldTransform().getOrigin().z(), 0.02, 1e-4) << shift;
    EXPECT_NEAR(upper.getWorldTransform().getOrigin().z(), 0.06, 1e-4) << shift;
    // They tremble: the field errs by up to a tenth of a voxel beside edges.
    EXPECT_LT(fastest, 0.025) << shift;
  }
}

// Points inside faces as contacts beside the edges would brake it.
TEST(ThinFaces, ABoxSlidesOnASlab) {
  World scene;
  bullet::Shape ground(thinned(make_box({0.3, 0.1, 0.02}), 0.002));
  bullet::Shape shape(thinned(make_box({0.03, 0.03, 0.03}), 0.001));
  scene.add(ground, 0, {0, 0, btScalar(-0.02)});
  btRigidBody& body = scene.add(shape, 1, {btScalar(-0.25), 0, btScalar(0.03)});
  body.setFriction(0);
  body.setLinearVelocity({1, 0, 0});
  scene.step(96);
  EXPECT_NEAR(body.getLinearVelocity().x(), 1, 0.005);
  EXPECT_NEAR(body.getWorldTransform().getOrigin().z(), 0.03, 2e-4);
  EXPECT_LT(body.getAngularVelocity().length(), 0.05);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Baked bodies that fall onto faces of others with a corner first.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

constexpr double kCornersVoxel = 0.002;

const std::shared_ptr<Asset>& cornered_cube() {
  static const std::shared_ptr<Asset> asset = baked_at(make_box({0.03, 0.03, 0.03}), kCornersVoxel);
  return asset;
}
const std::shared_ptr<Asset>& cornered_slab() {
  static const std::shared_ptr<Asset> asset = baked_at(make_box({0.08, 0.08, 0.015}), kCornersVoxel);
  return asset;
}
const std::shared_ptr<Asset>& cornered_spike() {
  static const std::shared_ptr<Asset> asset = [] {
    TriangleMesh mesh;
    mesh.vertices = {{0.03, 0.03, 0.03}, {0.03, -0.03, -0.03}, {-0.03, 0.03, -0.03}, {-0.03, -0.03, 0.03}};
    mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    return baked_at(mesh, kCornersVoxel);
  }();
  return asset;
}

const std::shared_ptr<Asset>& rounded_cube(double radius_vx) {
  static std::map<double, std::shared_ptr<Asset>> assets;
  std::shared_ptr<Asset>& asset = assets[radius_vx];
  if (!asset) asset = baked_at(make_rounded_cube(0.03, radius_vx * kCornersVoxel), kCornersVoxel);
  return asset;
}

// Both have a corner at (1, 1, 1). @return a rotation that nearly takes it down
btQuaternion corner_down(btScalar yaw) {
  const btVector3 corner = btVector3(1, 1, 1).normalized();
  const btVector3 axis = corner.cross(btVector3(0, 0, -1)).normalized();
  const btQuaternion down(axis, std::acos(-corner.z()));
  return btQuaternion({0, 1, 0}, btScalar(0.02)) * btQuaternion({0, 0, 1}, yaw) * down;
}

struct Landing {
  double deepest = 0;   // of the corner in the face below. [m]
  double sideways = 0;  // speed. [m/s]
};

// Falls at 1 m/s without friction; 0.1 s.
// @param radius  of the falling body's corner
Landing land(const std::shared_ptr<Asset>& falling, const std::shared_ptr<Asset>& ground, double top, btScalar yaw,
             double rate, double radius = 0) {
  World scene(kCornersVoxel);
  bullet::Shape above(falling);
  bullet::Shape below(ground);
  scene.add(below, 0, btVector3(0, 0, 0)).setFriction(0);
  const btQuaternion turn = corner_down(yaw);
  const btVector3 middle =
      btVector3(1, 1, 1) * btScalar(0.03 - radius) - above.centre_of_mass();  // of the corner's ball
  const btScalar drop = btScalar(top + radius + 0.002) - quatRotate(turn, middle).z();
  btRigidBody& body = scene.add(above, 1, btTransform(turn, {0, 0, drop}));
  body.setFriction(0);
  body.setLinearVelocity({0, 0, -1});
  Landing landing;
  for (int i = 0; i < int(0.1 * rate); ++i) {
    scene.step(1, btScalar(1 / rate));
    landing.deepest = std::max(landing.deepest, top + radius - double((body.getWorldTransform() * middle).z()));
  }
  const btVector3 v = body.getLinearVelocity();
  landing.sideways = std::hypot(double(v.x()), double(v.y()));
  return landing;
}

// Without the corners they went 2 to 5 voxels deep, and were pushed aside.
TEST(Corners, FallOnFacesOfBodiesThatGiveTheirPoints) {
  for (const double rate : {240.0, 1000.0}) {
    for (const btScalar yaw : {btScalar(0.3), btScalar(1), btScalar(2)}) {
      const Landing of_cube = land(cornered_cube(), cornered_cube(), 0.03, yaw, rate);
      EXPECT_LT(of_cube.deepest, 0.25 * kCornersVoxel) << rate << " Hz, yaw " << yaw;
      EXPECT_LT(of_cube.sideways, 0.03) << rate << " Hz, yaw " << yaw;
      const Landing of_spike = land(cornered_spike(), cornered_slab(), 0.015, yaw, rate);
      EXPECT_LT(of_spike.deepest, 0.25 * kCornersVoxel) << rate << " Hz, yaw " << yaw;
      EXPECT_LT(of_spike.sideways, 0.03) << rate << " Hz, yaw " << yaw;
    }
  }
}

// They went 0.5 to 4 voxels deep.
TEST(Corners, MayBeRounded) {
  for (const double radius_vx : {0.25, 0.75, 1.5}) {
    const double radius = radius_vx * kCornersVoxel;
    for (const double rate : {240.0, 1000.0}) {
      for (const btScalar yaw : {btScalar(1), btScalar(2)}) {
        const auto& cube = rounded_cube(radius_vx);
        EXPECT_LT(land(cube, cube, 0.03, yaw, rate, radius).deepest, 0.35 * kCornersVoxel)
            << "radius of " << radius_vx << " voxels, " << rate << " Hz, yaw " << yaw;
        EXPECT_LT(land(cube, cornered_slab(), 0.015, yaw, rate, radius).deepest, 0.35 * kCornersVoxel)
            << "radius of " << radius_vx << " voxels, " << rate << " Hz, yaw " << yaw;
      }
    }
  }
}

// Where enough points touch, corners that are no deeper add nothing.
TEST(Corners, OfABodyThatLiesFlatAddNoContacts) {
  World scene(kCornersVoxel);
  bullet::Shape above(cornered_cube());
  bullet::Shape below(cornered_slab(), bullet::Part::pointshell);  // which gives its points
  scene.add(below, 0, btVector3(0, 0, 0));
  scene.add(above, 1, btTransform(btQuaternion({0, 0, 1}, btScalar(0.4)), {btScalar(0.005), 0, btScalar(0.0449)}));
  for (int i = 0; i < 120; ++i) {
    scene.step(1);
    EXPECT_LE(scene.points().size(), 4U);
  }
  EXPECT_GE(scene.points().size(), 3U);
}

// The struck body gives its points to bodies that have none, too.
TEST(Corners, NeedNoRolesExchanged) {
  World scene(kCornersVoxel);
  bullet::Shape above(cornered_cube());
  bullet::Shape below(cornered_slab(), bullet::Part::pointshell);
  scene.add(below, 0, btVector3(0, 0, 0));
  const btQuaternion turn = corner_down(1);
  btRigidBody& body = scene.add(above, 1, btTransform(turn, {0, 0, btScalar(0.015 + 0.03 * std::sqrt(3.0) + 0.001)}));
  body.setLinearVelocity({0, 0, -1});
  double lowest = 1;
  for (int i = 0; i < 24; ++i) {
    scene.step(1);
    const btVector3 at = body.getWorldTransform() * (btVector3(1, 1, 1) * btScalar(0.03));
    lowest = std::min(lowest, double(at.z()));
  }
  EXPECT_GT(lowest, 0.015 - 0.25 * kCornersVoxel);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Bullet's manifolds and step_contacts give the same contacts for a pair: there is one way from a pair to its contacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "runtime/bullet/convert.h"
#include "runtime/vps_contacts.h"
#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

constexpr double kFrame = 1.0 / 60;

// A body of a world as step_contacts takes it.
struct BodyInStep {
  PointshellView shell;
  VoxelmapView map;
  StepMotion motion;
  StepBody body;

  BodyInStep(const btRigidBody& from, FieldRef field) : body{field, Pose()} {
    const btTransform& at = from.getWorldTransform();
    btTransform frame = at;
    if (const auto* const baked = dynamic_cast<const bullet::Shape*>(from.getCollisionShape()); baked != nullptr) {
      EXPECT_EQ(baked->asset().pointshell(shell), Status::ok);
      EXPECT_EQ(baked->asset().voxelmap(map), Status::ok);
      body.field = map;
      body.shell = &shell;
      frame = baked->mesh_pose(at);
    }
    body.pose = bullet::to_pose(frame, btTransform::getIdentity());
    const auto dt = btScalar(kFrame);
    const btVector3 gain = from.getInvMass() > 0 ? btVector3(0, 0, btScalar(-9.81) * dt) : btVector3(0, 0, 0);
    for (int i = 0; i < 3; ++i) motion.centre[i] = double(at.getOrigin()[i]);
    motion.way = bullet::to_vec3(dt * (from.getLinearVelocity() + gain));
    motion.turn = bullet::to_vec3(dt * from.getAngularVelocity());
    motion.fall = bullet::to_vec3(dt * gain);
    btVector3 centre;
    btScalar radius = 0;
    from.getCollisionShape()->getBoundingSphere(centre, radius);
    motion.radius = static_cast<float>(centre.length() + radius);
    motion.yields = from.getInvMass() > 0;
  }
};

// Plays a fall, and compares the contacts of every step.
void expect_one_path(bullet::Shape& falling, btCollisionShape& ground, FieldRef ground_field) {
  World scene;
  btRigidBody& floor = scene.add(ground, 0, {0, 0, 0});
  btRigidBody& body = scene.add(falling, 1, btTransform(btQuaternion({1, 2, 3}, 1), {0, 0, btScalar(0.35)}));
  body.setAngularVelocity({2, -1, 1});
  const auto voxel = static_cast<float>(falling.asset().info().voxel_size);
  StepMemory memory;
  StepScratch scratch;
  std::array<StepContact, 1024> room;
  int ahead = 0;
  int touching = 0;
  for (int i = 0; i < 90; ++i) {
    BodyInStep of_body(body, ground_field);
    BodyInStep of_floor(floor, ground_field);
    of_body.body.motion = &of_body.motion;
    of_floor.body.motion = &of_floor.motion;
    scene.step(1, btScalar(kFrame));
    const std::vector<btManifoldPoint> points = scene.points();
    // One manifold has four; bodies that land have one for each part that may touch.
    std::span<StepContact> found = std::span(room).first(points.size() > 4 ? room.size() : 4);
    const StepOptions options{0.1F * voxel, StepUse::constraints, &memory};
    ASSERT_EQ(step_contacts(of_body.body, of_floor.body, options, scratch, found), Status::ok);
    ASSERT_EQ(points.size(), found.size()) << i;
    for (const btManifoldPoint& point : points) {
      const btVector3 middle = (point.getPositionWorldOnA() + point.getPositionWorldOnB()) / 2;
      const auto same = std::find_if(found.begin(), found.end(), [&](const StepContact& contact) {
        const btVector3 at(btScalar(contact.position[0]), btScalar(contact.position[1]), btScalar(contact.position[2]));
        return (at - middle).length() < 2e-6 &&
               std::abs(double(point.getDistance()) + double(contact.penetration)) < 2e-6;
      });
      ASSERT_NE(same, found.end()) << i;
      EXPECT_GT(std::abs(bullet::to_bt(same->normal).dot(point.m_normalWorldOnB)), 0.99999) << i;
      (-point.getDistance() < btScalar(-0.1) * btScalar(voxel) ? ahead : touching) += 1;
    }
  }
  EXPECT_GT(ahead, 10);
  EXPECT_GT(touching, 60);
}

TEST(OnePath, BulletAndStepContactsGiveTheSameContactsThroughAFall) {
  bullet::Shape ring(baked_at(make_torus(0.1, 0.03, 64, 32), 0.004));
  bullet::Shape slab(baked_at(make_box({0.3, 0.3, 0.05}), 0.01));
  btBoxShape box({btScalar(0.3), btScalar(0.3), btScalar(0.05)});
  btStaticPlaneShape plane({0, 0, 1}, 0);
  const HalfSpaceField plane_field;
  expect_one_path(ring, slab, plane_field);
  const BoxField box_field{{0.3F, 0.3F, 0.05F}};
  expect_one_path(ring, box, box_field);
  expect_one_path(ring, plane, plane_field);
}

}  // namespace
}  // namespace vps::test

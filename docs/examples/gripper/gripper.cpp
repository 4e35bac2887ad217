// SPDX-License-Identifier: Zlib
// A robot of a URDF as a multibody: two baked fingers lift a baked block, shake it and set it down.
//   vpsbake scene gripper.toml && gripper gripper.vps/gripper.vps.json
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "runtime/bullet/vps_scene.h"

namespace {

constexpr btScalar kForce = 200;  // of the axes [N]
constexpr btScalar kGrip = 40;    // of the fingers [N]

btScalar smooth(btScalar t) {
  t = std::clamp(t, btScalar(0), btScalar(1));
  return t * t * (3 - 2 * t);
}
// Height of the palm above its start: lifts by 15 cm, shakes, sets down. [m]
btScalar height_at(btScalar t) {
  const btScalar shake = t > 1 && t < 2 ? btScalar(0.02) * std::sin(8 * SIMD_PI * t) : btScalar(0);
  return btScalar(0.15) * (smooth((t - btScalar(0.6)) / btScalar(0.4)) - smooth((t - 2) / btScalar(0.6))) + shake;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: gripper MANIFEST\n");
    return 1;
  }
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-1e-3);  // two voxels of the block
  // Bullet does not warm-start contacts of multibodies. With 10 iterations the block slips, and most grips drop it.
  world.getSolverInfo().m_numIterations = 50;

  vps::bullet::Scene scene = vps::bullet::load_scene(argv[1], world, {.multibodies = true});
  if (!scene.error().empty()) {
    std::fprintf(stderr, "gripper: %s\n", scene.error().c_str());
    return 1;
  }
  const btScalar step = scene.step();
  const auto motor_of = [&](const char* joint, btScalar force) {
    const vps::bullet::JointPlace place = scene.find_joint(joint);
    return btMultiBodyJointMotor(place.multibody, place.link, 0, force * step);
  };
  if (scene.find("block") == nullptr || scene.find_joint("gripper/lift").multibody == nullptr) {
    std::fprintf(stderr, "gripper: %s: this is not the scene of gripper.toml\n", argv[1]);
    return 1;
  }
  btMultiBodyJointMotor slide = motor_of("gripper/slide", kForce);
  btMultiBodyJointMotor lift = motor_of("gripper/lift", kForce);
  btMultiBodyJointMotor fingers[] = {motor_of("gripper/left_finger", kGrip), motor_of("gripper/right_finger", kGrip)};
  for (btMultiBodyJointMotor* const motor : {&slide, &lift, &fingers[0], &fingers[1]}) {
    world.addMultiBodyConstraint(motor);
  }
  const btRigidBody& block = *scene.find("block");
  const vps::bullet::JointPlace lifted = scene.find_joint("gripper/lift");
  btScalar top = 0;
  for (int i = 0; i < static_cast<int>(btScalar(3.2) / step); ++i) {
    const btScalar t = btScalar(i) * step;
    const btScalar late = height_at(t) - lifted.multibody->getJointPos(lifted.link);
    lift.setVelocityTarget((height_at(t + step) - height_at(t)) / step + btScalar(0.2) * late / step);
    for (btMultiBodyJointMotor& finger : fingers) finger.setVelocityTarget(btScalar(t < btScalar(2.7) ? 0.1 : -0.1));
    world.stepSimulation(step, 0);
    const btScalar z = scene.origin(block).getOrigin().z();
    top = std::max(top, z);
    if (i % 96 == 0) std::printf("%.1f s: the block is %.1f mm above the table\n", double(t), 1000 * double(z));
  }
  for (btMultiBodyJointMotor* const motor : {&slide, &lift, &fingers[0], &fingers[1]}) {
    world.removeMultiBodyConstraint(motor);
  }
  const btScalar end = scene.origin(block).getOrigin().z();
  const bool is_back = top > btScalar(0.15) && std::abs(end) < btScalar(1e-3);
  std::printf(is_back ? "it was lifted and stands on the table again\n" : "it was dropped\n");
  return is_back ? 0 : 2;
}

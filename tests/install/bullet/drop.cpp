// SPDX-License-Identifier: Zlib
// Drops an asset by 10 mm on the ground and prints the position of its centre of mass a second later.
#include <btBulletDynamicsCommon.h>

#include <cstdio>

#include "runtime/bullet/vps_bullet.h"
#include "runtime/bullet/vps_scene.h"

int main(int argc, char** argv) {
  auto asset = std::make_shared<vps::Asset>();
  const auto status = vps::Asset::open(argc == 2 ? argv[1] : nullptr, *asset);
  if (status != vps::Status::ok) {
    std::fprintf(stderr, "drop: %s\n", vps::describe(status));
    return 1;
  }
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-2 * asset->info().voxel_size);
  vps::bullet::register_algorithm(dispatcher);

  vps::bullet::Shape shape(asset);
  btStaticPlaneShape plane({0, 1, 0}, 0);
  btRigidBody ground(0, nullptr, &plane);
  btVector3 inertia;
  shape.calculateLocalInertia(1, inertia);
  btRigidBody body(1, nullptr, &shape, inertia);
  const auto lowest = btScalar(asset->info().bounds_min[1]) - shape.centre_of_mass().y();
  body.setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, btScalar(0.01) - lowest, 0}));
  world.addRigidBody(&ground);
  world.addRigidBody(&body);
  for (int step = 0; step < 200; ++step) world.stepSimulation(btScalar(0.005), 0);
  const btScalar height = body.getWorldTransform().getOrigin().y();
  world.removeRigidBody(&body);
  world.removeRigidBody(&ground);
  std::printf("the centre of mass is %.3g mm above the ground\n", 1000 * double(height));
  if (vps::bullet::load_scene("none.vps.json", world).error().empty()) return 1;
  return height > 0 ? 0 : 1;
}

// SPDX-License-Identifier: Zlib
// Drops a body over another that stands on the ground: docs/tutorial.md.
// usage: falling_body FALLING STANDING [MOTION]
// FALLING and STANDING are assets. MOTION is the file to write for `vpsbake view --motion`; it names the assets
// relative to its own folder, by the paths given here.
#include <btBulletDynamicsCommon.h>

#include <cstdio>
#include <fstream>
#include <memory>

#include "runtime/bullet/vps_bullet.h"

namespace {

constexpr btScalar kStep = btScalar(1.0 / 240);  // [s]
constexpr int kSteps = 60;
constexpr int kStepsPerLine = 6;
constexpr btScalar kDrop = btScalar(0.01);  // above the top of the standing body [m]
constexpr btScalar kTilt = btScalar(0.05);  // [rad]

std::shared_ptr<const vps::Asset> open_asset(const char* file) {
  auto asset = std::make_shared<vps::Asset>();
  const vps::Status status = vps::Asset::open(file, *asset);
  if (status == vps::Status::ok) return asset;
  std::fprintf(stderr, "falling_body: %s: %s\n", file, vps::describe(status));
  return nullptr;
}

// Height of the mesh's lowest point above the body's origin, which is the centre of mass. [m]
btScalar lowest(const vps::bullet::Shape& shape) {
  return btScalar(shape.asset().info().bounds_min[2]) - shape.centre_of_mass().z();
}
btScalar highest(const vps::bullet::Shape& shape) {
  return btScalar(shape.asset().info().bounds_max[2]) - shape.centre_of_mass().z();
}

// Writes the pose of the mesh's own frame, as docs/motion.md defines it.
void write_pose(std::ostream& out, const btRigidBody& body, const vps::bullet::Shape& shape) {
  const btTransform at = shape.mesh_pose(body.getWorldTransform());
  const btVector3& p = at.getOrigin();
  const btQuaternion q = at.getRotation();
  out << '[' << p.x() << ',' << p.y() << ',' << p.z() << ',' << q.x() << ',' << q.y() << ',' << q.z() << ',' << q.w()
      << ']';
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 && argc != 4) {
    std::fprintf(stderr, "usage: falling_body FALLING STANDING [MOTION]\n");
    return 1;
  }
  const auto falling_asset = open_asset(argv[1]);
  const auto standing_asset = open_asset(argv[2]);
  if (!falling_asset || !standing_asset) return 1;

  // An ordinary Bullet world. Only the call of register_algorithm is new.
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  vps::bullet::register_algorithm(dispatcher);
  world.setGravity({0, 0, btScalar(-9.81)});
  world.getSolverInfo().m_splitImpulsePenetrationThreshold = btScalar(-5e-4);  // two voxels
  world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;

  btStaticPlaneShape plane({0, 0, 1}, 0);
  btRigidBody ground(0, nullptr, &plane);

  vps::bullet::Shape standing_shape(standing_asset);
  btRigidBody standing(0, nullptr, &standing_shape);
  const btVector3 at_origin(0, 0, -btScalar(standing_asset->info().bounds_min[2]));
  standing.setWorldTransform(standing_shape.body_pose(btTransform(btQuaternion::getIdentity(), at_origin)));
  const btScalar top = highest(standing_shape) - lowest(standing_shape);

  const btScalar mass = btScalar(0.01);
  vps::bullet::Shape falling_shape(falling_asset);
  btVector3 inertia;
  falling_shape.calculateLocalInertia(mass, inertia);
  btRigidBody falling(mass, nullptr, &falling_shape, inertia);
  falling.setWorldTransform(btTransform(btQuaternion({1, 0, 0}, kTilt), {0, 0, top + kDrop - lowest(falling_shape)}));
  falling.setSleepingThresholds(btScalar(0.025), 2);  // lint reports Bullet's own, which suit bodies of metres

  world.addRigidBody(&ground);
  world.addRigidBody(&standing);
  world.addRigidBody(&falling);
  for (const auto& advice : vps::bullet::lint(world, kStep)) {
    std::printf("%s: %s\n", advice.setting.c_str(), advice.text.c_str());
  }

  std::ofstream motion;
  if (argc == 4) motion.open(argv[3]);
  motion << R"({"format": "vps-motion 1", "bodies": [{"asset": ")" << argv[1] << R"("}, {"asset": ")" << argv[2]
         << R"("}, {"name": "ground", "box": [0.03, 0.03, 0.001]}], "times": [0)";
  for (int step = 1; step <= kSteps; ++step) motion << ',' << step * kStep;
  motion << "], \"poses\": [";
  for (int step = 0; step <= kSteps; ++step) {
    if (step > 0) world.stepSimulation(kStep, 0);
    motion << (step > 0 ? ",\n[" : "\n[");
    write_pose(motion, falling, falling_shape);
    motion << ',';
    write_pose(motion, standing, standing_shape);
    motion << ",[0,0,-0.001,0,0,0,1]]";
    if (step % kStepsPerLine == 0) {
      std::printf("%.3f s: centre of mass at %6.2f mm, %6.1f mm/s\n", double(step * kStep),
                  1000 * double(falling.getWorldTransform().getOrigin().z()),
                  1000 * double(falling.getLinearVelocity().length()));
    }
  }
  motion << "]}\n";
  if (argc == 4 && !motion.flush()) {
    std::fprintf(stderr, "falling_body: %s: cannot be written\n", argv[3]);
    return 1;
  }

  const btScalar height = falling.getWorldTransform().getOrigin().z() + lowest(falling_shape);
  const bool lies = height < btScalar(0.0005) && falling.getLinearVelocity().length() < btScalar(0.005);
  for (btRigidBody* body : {&falling, &standing, &ground}) world.removeRigidBody(body);
  std::puts(lies ? "it lies on the ground" : "it does not lie on the ground");
  return lies ? 0 : 1;
}

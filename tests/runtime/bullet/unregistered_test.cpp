// SPDX-License-Identifier: GPL-3.0-or-later
// A separate program, as the message is printed only if no dispatcher of the program has the algorithm registered.
#include <gtest/gtest.h>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

std::vector<std::string> lines;

TEST(Unregistered, AWorldOfShapesAloneIsToldInTheFirstStep) {
  bullet::set_message_handler([](const char* line) { lines.emplace_back(line); });
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  bullet::Shape shape(baked_at(make_box({0.05, 0.05, 0.05}), 0.005));
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  for (int i = 0; i < 3; ++i) {
    bodies.push_back(std::make_unique<btRigidBody>(btScalar(i), nullptr, &shape, btVector3(1, 1, 1)));
    bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), {0, 0, btScalar(0.11 * i)}));
    world.addRigidBody(bodies.back().get());
  }
  EXPECT_TRUE(lines.empty());
  world.stepSimulation(btScalar(1.0 / 240), 0);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find("register_algorithm(*dispatcher) before the first step"), std::string::npos) << lines[0];
  world.stepSimulation(btScalar(1.0 / 240), 0);
  EXPECT_EQ(lines.size(), 1U);
  for (const auto& body : bodies) world.removeRigidBody(body.get());
}

}  // namespace
}  // namespace vps::test

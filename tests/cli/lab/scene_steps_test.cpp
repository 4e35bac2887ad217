// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/scene_steps.h"

#include <gtest/gtest.h>

#include "cli/lab/stress/world.h"
#include "sample_meshes/shapes.h"

namespace vps::test {
namespace {

using lab::Scene;

constexpr double kHalf = 0.05;  // [m]

lab::SceneTimes play(const TriangleMesh& mesh, const std::shared_ptr<btCollisionShape>& shape) {
  lab::SceneOptions options;
  options.voxel = kHalf / 20;
  options.corners = stress::hull_corners(mesh.vertices);
  options.rotations = 2;
  options.rounds = 2;
  const lab::Player players[] = {{"not played", {}}, {"played", [&] { return lab::BulletShape{{}, shape}; }}};
  const std::vector<lab::SceneTimes> times = lab::play_in_turn(players, options);
  EXPECT_EQ(times.at(0).dearest().rounds, 0U);
  return times.at(1);
}

const TriangleMesh kCube = samples::make_box({kHalf, kHalf, kHalf});

std::shared_ptr<btCollisionShape> cube(double half) {
  return std::make_shared<btBoxShape>(btVector3(btScalar(half), btScalar(half), btScalar(half)));
}

TEST(SceneSteps, ACubeLandsRestsAndLiesFlatAndEveryScenesNarrowphaseIsPartOfItsSteps) {
  const lab::SceneTimes times = play(kCube, cube(kHalf));
  EXPECT_EQ(times.failure, "");
  for (const Scene scene : lab::kScenes) {
    const auto& [whole, narrowphase] = times.scenes[std::size_t(scene)];
    EXPECT_EQ(whole.rounds, 2U) << lab::describe(scene);
    EXPECT_GT(narrowphase.p50, 0) << lab::describe(scene);
    EXPECT_GT(whole.p50, narrowphase.p50) << lab::describe(scene);
    EXPECT_GE(whole.p99, whole.p50) << lab::describe(scene);
    EXPECT_GE(times.dearest().p99, whole.p99) << lab::describe(scene);
  }
}

TEST(SceneSteps, ABallHasNoFlatSide) {
  const TriangleMesh ball = samples::make_sphere(kHalf, 3);
  const lab::SceneTimes times = play(ball, std::make_shared<btSphereShape>(btScalar(kHalf)));
  EXPECT_EQ(times.failure, "");
  EXPECT_GT(times.scenes[std::size_t(Scene::landing)].whole.rounds, 0U);
  EXPECT_GT(times.scenes[std::size_t(Scene::resting)].whole.rounds, 0U);
  EXPECT_EQ(times.scenes[std::size_t(Scene::flat)].whole.rounds, 0U);
}

TEST(SceneSteps, ABodyThatSinksIntoTheBoxHasNoTimes) {
  const lab::SceneTimes times = play(kCube, cube(kHalf / 2));
  EXPECT_EQ(times.failure, "falls through a box");
  EXPECT_EQ(times.dearest().rounds, 0U);
}

}  // namespace
}  // namespace vps::test

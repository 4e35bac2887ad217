// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes of bodies that turn on and hang in each other, which hulls cannot play: with those they fail.
#include <cmath>
#include <numbers>
#include <optional>

#include "tests/runtime/mujoco/world.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kSteel = 7800;    // [kg/m^3]
constexpr double kGravity = 9.81;  // [m/s^2]
// As stiff as the step allows: two steps' time, and full impedance from a hundredth of a millimetre on.
constexpr const char* kStiff = R"(solref="0.001 1" solimp="0.99 0.999 0.00001")";

// What tests/scenes/nut_on_bolt.cpp measures in Bullet.
struct Descent {
  double turned = 0;     // [rad]
  double fallen = 0;     // [m]
  double off_helix = 0;  // at most. [m]
  double deepest = 0;    // [m]
  double gain = 0;       // of energy beyond the work done. [J]
};

constexpr double kVoxelOfThread = 0.00015, kSeconds = 0.5;
constexpr int kSteps = 1000;
const MujocoMesh& bolt() {
  static const MujocoMesh mesh = mujoco_mesh("bolt", samples::make_bolt(), kVoxelOfThread);
  return mesh;
}
const MujocoMesh& nut() {
  static const MujocoMesh mesh = mujoco_mesh("nut", samples::make_nut(), kVoxelOfThread);
  return mesh;
}

constexpr double kTurnPerMetre = 2 * std::numbers::pi / samples::kM10.pitch;
double mass_of_nut() {
  return kSteel * nut().asset->info().volume;
}
// Gravity's torque through the helix twice over: by gravity alone the sample's facets lock.
double torque_on_nut() {
  return -2 * mass_of_nut() * kGravity / kTurnPerMetre;
}
double frictionless_descent() {
  const double inertia = kSteel * nut().asset->info().inertia[2] * kTurnPerMetre * kTurnPerMetre;
  const double acceleration = (mass_of_nut() * kGravity - torque_on_nut() * kTurnPerMetre) / (mass_of_nut() + inertia);
  return acceleration * kSeconds * kSeconds / 2;
}

Descent turn_nut(Collide collide) {
  MujocoWorld world({bolt(), nut()}, R"(timestep="0.0005")",
                    fmt::format(R"(<geom type="mesh" mesh="bolt" condim="1" {0}/>
                      <body name="nut" pos="0 0 {1}"><freejoint/>{2}
                      <geom type="mesh" mesh="nut" condim="1" {0}/></body>)",
                                kStiff, 3 * samples::kM10.pitch, inertial(*nut().asset, kSteel)));
  std::optional<mujoco::BakedModel> baked;
  if (collide == Collide::baked) {
    baked.emplace(*world.model);
    mujoco::MeshOptions options;
    options.use = StepUse::samples;
    EXPECT_EQ(baked->bake("bolt", bolt().asset, options), "");
    EXPECT_EQ(baked->bake("nut", nut().asset, options), "");
  }
  const int body = world.body("nut");
  world.forward();
  const double start = world.data->xipos[3 * body + 2];
  const double start_energy = world.energy();
  world.data->xfrc_applied[6 * body + 5] = torque_on_nut();
  Pose last = world.pose(body);
  double work = 0;
  Descent out;
  for (int step = 1; step <= kSteps; ++step) {
    world.step();
    const Pose now = world.pose(body);
    const auto turn = [&](int i, int k) {
      double sum = 0;
      for (int j = 0; j < 3; ++j) sum += now.rotation[3 * i + j] * last.rotation[3 * k + j];
      return sum;
    };
    const double angle = std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
    last = now;
    out.turned += angle;
    work += torque_on_nut() * angle;
    out.fallen = start - world.data->xipos[3 * body + 2];
    out.off_helix = std::max(out.off_helix, std::abs(out.fallen + out.turned / kTurnPerMetre));
    out.gain = std::max(out.gain, world.energy() - start_energy - work);
    if (step % 10 == 0) out.deepest = std::max(out.deepest, depth(*bolt().asset, Pose(), *nut().asset, now));
  }
  return out;
}

// The verdict of the same scene in Bullet.
testing::AssertionResult follows_the_thread(const Descent& nut_went) {
  constexpr double kPlay = samples::kThreadClearance * samples::kM10.pitch / 2 / samples::kM10.depth;
  const double free = frictionless_descent();
  const bool follows = nut_went.off_helix < kPlay + kVoxelOfThread / 10 && nut_went.fallen > 0.3 * free &&
                       nut_went.fallen < free + 2 * kPlay && nut_went.deepest < kVoxelOfThread / 2 &&
                       nut_went.gain < 0.01 * mass_of_nut() * kGravity * samples::kM10.pitch;
  return (follows ? testing::AssertionSuccess() : testing::AssertionFailure())
         << fmt::format("turned {:.2f} rad, fell {:.3f} mm of {:.3f}; off the helix {:.4f} mm; deepest {:.4f} mm; {} J",
                        nut_went.turned, 1e3 * nut_went.fallen, 1e3 * free, 1e3 * nut_went.off_helix,
                        1e3 * nut_went.deepest, nut_went.gain);
}

TEST(MujocoScenes, ANutTurnsDownABolt) {
  EXPECT_TRUE(follows_the_thread(turn_nut(Collide::baked)));
}
TEST(MujocoScenes, ANutOfHullsIsShotOff) {
  const Descent nut_went = turn_nut(Collide::as_hulls);
  EXPECT_FALSE(follows_the_thread(nut_went));
  EXPECT_GT(nut_went.off_helix, 0.01);
}

// A tube along a path in the plane y = 0, with flat ends.
TriangleMesh make_tube(const std::vector<std::array<double, 2>>& path, double radius, std::uint32_t around) {
  TriangleMesh mesh;
  const auto rows = static_cast<std::uint32_t>(path.size());
  for (std::uint32_t row = 0; row < rows; ++row) {
    const auto& before = path[row > 0 ? row - 1 : 0];
    const auto& after = path[row + 1 < rows ? row + 1 : row];
    const double along[2] = {after[0] - before[0], after[1] - before[1]};
    const double size = std::hypot(along[0], along[1]);
    for (std::uint32_t i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      const double across = radius * std::cos(angle) / size;
      mesh.vertices.push_back(
          {path[row][0] + across * along[1], radius * std::sin(angle), path[row][1] - across * along[0]});
    }
  }
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t a = row * around + i;
      const std::uint32_t b = row * around + (i + 1) % around;
      mesh.triangles.push_back({a, b, b + around});
      mesh.triangles.push_back({a, b + around, a + around});
    }
  }
  const auto caps = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back({path.front()[0], 0, path.front()[1]});
  mesh.vertices.push_back({path.back()[0], 0, path.back()[1]});
  const std::uint32_t last = (rows - 1) * around;
  for (std::uint32_t i = 0; i < around; ++i) {
    mesh.triangles.push_back({caps, (i + 1) % around, i});
    mesh.triangles.push_back({caps + 1, last + i, last + (i + 1) % around});
  }
  return mesh;
}

// A J: a shank above a half circle that is open at the top.
TriangleMesh make_hook() {
  constexpr double kBend = 0.012;
  std::vector<std::array<double, 2>> path = {{kBend, 0.05}, {kBend, 0.025}};
  for (int i = 0; i <= 24; ++i) {
    const double angle = std::numbers::pi * i / 24;
    path.push_back({kBend * std::cos(angle), -kBend * std::sin(angle)});
  }
  path.push_back({-kBend, 0.008});
  return make_tube(path, 0.004, 24);
}

struct Hang {
  double lowest = 0;   // of the ring's centre. [m]
  double deepest = 0;  // in the last tenth of a second. [m]
  double speed = 0;    // in the end. [m/s]
};

// A ring falls by half a millimetre onto a hook, and swings.
Hang hang_ring(Collide collide) {
  constexpr double kVoxelOfHook = 0.0005;
  constexpr int kStepsOfRing = 2000;
  static const MujocoMesh hook = mujoco_mesh("hook", make_hook(), kVoxelOfHook);
  static const MujocoMesh ring = mujoco_mesh("ring", samples::make_torus(0.016, 0.0035, 48, 24), kVoxelOfHook);
  MujocoWorld world({hook, ring}, R"(timestep="0.001")",
                    fmt::format(R"(<geom type="mesh" mesh="hook"/>
                      <body name="ring" pos="0.001 0.002 -0.02" euler="0 90 11"><freejoint/>{}
                      <geom type="mesh" mesh="ring"/></body>)",
                                inertial(*ring.asset, kSteel)));
  std::optional<mujoco::BakedModel> baked;
  if (collide == Collide::baked) {
    baked.emplace(*world.model);
    EXPECT_EQ(baked->bake("hook", hook.asset), "");
    EXPECT_EQ(baked->bake("ring", ring.asset), "");
  }
  const int body = world.body("ring");
  Hang out;
  for (int step = 1; step <= kStepsOfRing; ++step) {
    world.step();
    const Pose now = world.pose(body);
    out.lowest = std::min(out.lowest, now.translation[2]);
    if (step > kStepsOfRing - 100 && step % 10 == 0)
      out.deepest = std::max(out.deepest, depth(*hook.asset, Pose(), *ring.asset, now));
  }
  out.speed = mju_norm3(world.data->qvel);
  return out;
}

TEST(MujocoScenes, ARingHangsInAHook) {
  const Hang ring = hang_ring(Collide::baked);
  EXPECT_GT(ring.lowest, -0.0215);
  EXPECT_LT(ring.deepest, 0.0005 / 2);
  EXPECT_LT(ring.speed, 0.05);
}
TEST(MujocoScenes, ARingAroundTheHullOfAHookIsThrownOff) {
  EXPECT_LT(hang_ring(Collide::as_hulls).lowest, -1);
}

// A ball rolls 4 m on a plane and on a box, between the points of its shell.
TEST(MujocoScenes, ABallKeepsRolling) {
  constexpr double kRadius = 0.05, kSpeed = 2;
  static const MujocoMesh ball = mujoco_mesh("ball", samples::make_sphere(kRadius, 4), kRadius / 32);
  for (const char* const ground :
       {R"(<geom type="plane" size="9 9 1"/>)", R"(<geom type="box" pos="2 0 -0.1" size="9 1 0.1"/>)"}) {
    MujocoWorld world({ball}, R"(timestep="0.002")",
                      fmt::format(R"({}<body pos="0 0 {}"><freejoint/>{}<geom type="mesh" mesh="ball"/></body>)",
                                  ground, kRadius, inertial(*ball.asset, 1000)));
    mujoco::BakedModel baked(*world.model);
    EXPECT_EQ(baked.bake("ball", ball.asset), "");
    world.data->qvel[0] = kSpeed;
    world.data->qvel[4] = kSpeed / kRadius;
    for (int step = 0; step < 1000; ++step) world.step();
    EXPECT_GT(world.data->qvel[0], 0.99 * kSpeed) << ground;
    EXPECT_NEAR(world.data->qpos[1], 0, 0.01) << ground;
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <thread>

#include "tests/runtime/mujoco/world.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kVoxelOfCube = 0.001;
const MujocoMesh& cube() {
  static const MujocoMesh mesh = mujoco_mesh("cube", make_box({0.02, 0.02, 0.02}), kVoxelOfCube);
  return mesh;
}
// Its centre of mass is not its origin: MuJoCo moves the mesh.
const MujocoMesh& block() {
  static const MujocoMesh mesh =
      mujoco_mesh("block", make_box({0.02, 0.012, 0.008}, {0.05, -0.02, 0.01}), kVoxelOfCube);
  return mesh;
}

// The geoms that a baked one meets, each with its top at z = 0.
const char* const kGrounds[] = {
    R"(type="plane" size="1 1 1")",
    R"(type="sphere" size="0.1" pos="0 0 -0.1")",
    R"(type="capsule" size="0.05 0.1" pos="0 0 -0.05" euler="0 90 0")",
    R"(type="cylinder" size="0.1 0.05" pos="0 0 -0.05")",
    R"(type="box" size="0.1 0.1 0.05" pos="0 0 -0.05")",
    R"(type="mesh" mesh="block" pos="-0.05 0.02 -0.018")",
};
constexpr int kMeshGround = 5;

// A cube at a height above one of them.
MujocoWorld cube_on(int ground, double height, const std::string& attributes = {}) {
  return {{cube(), block()},
          "",
          fmt::format(R"(<geom name="ground" {0} {2}/>
    <body name="cube" pos="0.0013 0.0007 {1}"><freejoint/><geom type="mesh" mesh="cube" mass="1" {2}/></body>)",
                      kGrounds[ground], 0.02 + height, attributes)};
}

TEST(BakedModel, ACubeHasTheDepthAndDirectionThatItHasAsAHull) {
  for (int ground = 0; ground <= kMeshGround; ++ground) {
    MujocoWorld world = cube_on(ground, -0.0003);
    world.forward();
    ASSERT_GT(world.data->ncon, 0) << kGrounds[ground];
    const mjtNum as_hull = world.contacts()[0].dist;
    mujoco::BakedModel baked(*world.model);
    ASSERT_EQ(baked.bake("cube", cube().asset), "");
    world.forward();
    ASSERT_GT(world.data->ncon, 0) << kGrounds[ground];
    ASSERT_LE(world.data->ncon, 16) << kGrounds[ground];
    const mjContact& contact = world.contacts()[0];
    EXPECT_NEAR(contact.dist, as_hull, 0.1 * kVoxelOfCube) << kGrounds[ground];
    EXPECT_NEAR(contact.dist, -0.0003, 0.1 * kVoxelOfCube) << kGrounds[ground];
    EXPECT_NEAR(contact.pos[2], -0.00015, 0.1 * kVoxelOfCube) << kGrounds[ground];
    // From the first geom to the second.
    const bool ground_is_first = contact.geom1 == mj_name2id(world.model.get(), mjOBJ_GEOM, "ground");
    EXPECT_GT(ground_is_first ? contact.frame[2] : -contact.frame[2], 0.999) << kGrounds[ground];
    for (const mjContact& other : world.contacts()) EXPECT_GE(other.dist, contact.dist) << kGrounds[ground];
  }
}

TEST(BakedModel, TwoBakedGeomsMeet) {
  MujocoWorld world = cube_on(kMeshGround, -0.0003);
  mujoco::BakedModel baked(*world.model);
  ASSERT_EQ(baked.bake("cube", cube().asset), "");
  // Its geom has a place of its own in the world.
  EXPECT_NE(baked.bake("block", block().asset), "");
  Pose in_world;
  in_world.translation[0] = -0.05;
  in_world.translation[1] = 0.02;
  in_world.translation[2] = -0.018;
  mujoco::MeshOptions options;
  options.in_body = &in_world;
  ASSERT_EQ(baked.bake("block", block().asset, options), "");
  world.forward();
  ASSERT_GE(world.data->ncon, 4);
  EXPECT_NEAR(world.contacts()[0].dist, -0.0003, 0.1 * kVoxelOfCube);
  for (const mjContact& contact : world.contacts()) {
    EXPECT_NEAR(contact.dist, -0.0003, 0.3 * kVoxelOfCube);
    EXPECT_LT(std::abs(contact.pos[0]), 0.0201);
    EXPECT_LT(std::abs(contact.pos[1]), 0.0121);
  }
}

// The place of a mesh in one geom gives that in all.
TEST(BakedModel, GeomsOfAMeshAnywhereInTheirBodiesAreBaked) {
  MujocoWorld world({block()}, "", R"(<geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.0077"><freejoint/><geom type="mesh" mesh="block" mass="1" pos="0.3 0 0" euler="0 0 30"/></body>
    <body pos="0 0 0.0077"><freejoint/><geom type="mesh" mesh="block" mass="1" pos="0 0 -0.01"/></body>
    <body pos="0.2 0 -0.0023"><freejoint/><geom type="mesh" mesh="block" mass="1"/></body>)");
  mujoco::BakedModel baked(*world.model);
  ASSERT_EQ(baked.bake("block", block().asset), "");
  world.forward();
  int contacts[4] = {};
  for (const mjContact& contact : world.contacts()) {
    ++contacts[world.model->geom_bodyid[contact.geom2]];
    EXPECT_NEAR(contact.dist, -0.0003, 0.1 * kVoxelOfCube);
  }
  EXPECT_EQ(contacts[1], 0);  // 10 mm above the plane
  EXPECT_GE(contacts[2], 4);
  EXPECT_GE(contacts[3], 4);
}

TEST(BakedModel, TheGeomThatFitsBestPlacesTheAsset) {
  MujocoWorld world({cube()}, "", R"(<geom type="plane" size="1 1 1"/>
    <body pos="0 0 0.0197"><freejoint/>
      <geom type="mesh" mesh="cube" mass="1" pos="0.0003 0 0" contype="0" conaffinity="0"/>
      <geom type="mesh" mesh="cube" mass="1"/></body>)");
  mujoco::BakedModel baked(*world.model);
  ASSERT_EQ(baked.bake("cube", cube().asset), "");
  world.forward();
  double least = 1, most = -1;
  for (const mjContact& contact : world.contacts()) {
    least = std::min(least, contact.pos[0]);
    most = std::max(most, contact.pos[0]);
  }
  EXPECT_NEAR(least, -0.02, 0.1 * kVoxelOfCube);
  EXPECT_NEAR(most, 0.02, 0.1 * kVoxelOfCube);
}

TEST(BakedModel, AnAssetOfAnotherSizeIsRefused) {
  const MujocoMesh small = mujoco_mesh("small", make_box({0.0194, 0.0194, 0.0194}), kVoxelOfCube);
  MujocoWorld world({small, cube()}, "", R"(<body><freejoint/><geom type="mesh" mesh="small"/></body>)");
  mujoco::BakedModel baked(*world.model);
  EXPECT_NE(baked.bake("small", cube().asset).find("give in_body"), std::string::npos);
  EXPECT_EQ(baked.bake("small", small.asset), "");
  EXPECT_EQ(baked.bake("cube", cube().asset), "mesh \"cube\": no geom of the model has it");
}

TEST(BakedModel, AMarginGivesContactsThatDoNotTouchYet) {
  for (const bool has_margin : {false, true}) {
    MujocoWorld world = cube_on(0, 0.0004, has_margin ? R"(margin="0.001" gap="0.001")" : "");
    mujoco::BakedModel baked(*world.model);
    ASSERT_EQ(baked.bake("cube", cube().asset), "");
    world.forward();
    ASSERT_EQ(world.data->ncon > 0, has_margin);
    for (const mjContact& contact : world.contacts()) EXPECT_NEAR(contact.dist, 0.0004, 0.1 * kVoxelOfCube);
  }
}

TEST(BakedModel, ContactsAreNoMoreThanAskedFor) {
  for (const int most : {1, 4, 50}) {
    MujocoWorld world = cube_on(0, -0.0003);
    mujoco::BakedModel baked(*world.model);
    mujoco::MeshOptions options;
    options.contacts = most;
    options.use = StepUse::samples;
    ASSERT_EQ(baked.bake("cube", cube().asset, options), "");
    world.forward();
    EXPECT_LE(world.data->ncon, most);
    EXPECT_GE(world.data->ncon, std::min(most, 16));
  }
}

TEST(BakedModel, TheSameStatesHaveTheSameContactsInAnyThread) {
  MujocoWorld world = cube_on(3, -0.0003);
  mujoco::BakedModel baked(*world.model);
  ASSERT_EQ(baked.bake("cube", cube().asset), "");
  const auto run = [&](std::vector<mjtNum>& out) {
    mjData* const data = mj_makeData(world.model.get());
    for (int i = 0; i < 200; ++i) mj_step(world.model.get(), data);
    out.assign(data->qpos, data->qpos + world.model->nq);
    mj_deleteData(data);
  };
  std::vector<mjtNum> alone;
  run(alone);
  std::vector<mjtNum> parallel[2];
  std::thread one(run, std::ref(parallel[0]));
  std::thread two(run, std::ref(parallel[1]));
  one.join();
  two.join();
  EXPECT_EQ(parallel[0], alone);
  EXPECT_EQ(parallel[1], alone);
}

TEST(BakedModel, GeomsCollideAsHullsAgainWhenItEnds) {
  static const MujocoMesh ring = mujoco_mesh("ring", make_torus(0.03, 0.01, 48, 24), kVoxelOfCube);
  // A ball in the middle of the ring.
  MujocoWorld world({ring}, "",
                    R"(<geom type="mesh" mesh="ring"/><body><freejoint/><geom size="0.01" mass="1"/></body>)");
  world.forward();
  EXPECT_GT(world.data->ncon, 0);
  {
    mujoco::BakedModel baked(*world.model);
    ASSERT_EQ(baked.bake("ring", ring.asset), "");
    world.forward();
    EXPECT_EQ(world.data->ncon, 0);
  }
  world.forward();
  EXPECT_GT(world.data->ncon, 0);
}

// A torus with a cavity aside. Turned by half a turn all vertices but eight still fit.
TEST(BakedModel, APartWhoseCavityIsOnTheOtherSideIsRefused) {
  TriangleMesh mesh = make_torus(0.03, 0.01, 48, 24);
  const TriangleMesh cavity = make_box({0.004, 0.004, 0.004}, {0.03, 0, 0});
  const auto first = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), cavity.vertices.begin(), cavity.vertices.end());
  for (const auto& t : cavity.triangles) mesh.triangles.push_back({first + t[0], first + t[2], first + t[1]});
  const MujocoMesh part = mujoco_mesh("part", mesh, kVoxelOfCube);
  const auto bodies = [](const char* euler) {
    return fmt::format(R"(<body><freejoint/><geom type="mesh" mesh="part" mass="1" euler="{}"/></body>)", euler);
  };
  MujocoWorld turned({part}, "", bodies("0 0 180"));
  mujoco::BakedModel of_turned(*turned.model);
  EXPECT_NE(of_turned.bake("part", part.asset).find("give in_body"), std::string::npos);
  Pose in_body;
  in_body.rotation[0] = in_body.rotation[4] = -1;
  mujoco::MeshOptions options;
  options.in_body = &in_body;
  EXPECT_EQ(of_turned.bake("part", part.asset, options), "");
  MujocoWorld straight({part}, "", bodies("0 0 0"));
  EXPECT_EQ(mujoco::BakedModel(*straight.model).bake("part", part.asset), "");
}

TEST(BakedModel, ASecondOneOfAModelLeavesTheFirstAsItIs) {
  MujocoWorld world = cube_on(0, -0.0003);
  mujoco::BakedModel first(*world.model);
  ASSERT_EQ(first.bake("cube", cube().asset, {nullptr, 3}), "");
  {
    mujoco::BakedModel second(*world.model);
    EXPECT_NE(second.bake("cube", cube().asset).find("another BakedModel"), std::string::npos);
  }
  world.forward();
  EXPECT_EQ(world.data->ncon, 3) << "a hull has 4";
}

TEST(BakedModel, SaysWhatIsWrong) {
  MujocoWorld world = cube_on(0, 0);
  mujoco::BakedModel baked(*world.model);
  const auto says = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  EXPECT_TRUE(says(baked.bake("ball", cube().asset), "mesh \"ball\": the model has none of this name"));
  EXPECT_TRUE(says(baked.bake("cube", nullptr), "not open"));
  EXPECT_TRUE(says(baked.bake("cube", std::make_shared<Asset>()), "not open"));
  EXPECT_TRUE(says(baked.bake("cube", block().asset), "give in_body"));
  mujoco::MeshOptions options;
  options.contacts = 51;
  EXPECT_TRUE(says(baked.bake("cube", cube().asset, options), "1 to 50"));
  options.contacts = 4;
  options.use = StepUse::springs;
  EXPECT_TRUE(says(baked.bake("cube", cube().asset, options), "springs of their own"));
  options.use = StepUse::constraints;
  Pose twice;
  twice.rotation[0] = 2;
  options.in_body = &twice;
  EXPECT_TRUE(says(baked.bake("cube", cube().asset, options), "no pose"));
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Manifests in Bullet: bodies get what is stated, and what is wrong is refused in one line.
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "runtime/bullet/vps_scene.h"
#include "tests/support/bullet_world.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// A manifest with one plane and one sphere, which needs no asset.
Json simple() {
  return Json::parse(R"({"format": "vps-scene", "version": 1, "step": 0.004, "gravity": [0, 0, -10], "assets": [],
    "bodies": [
      {"name": "ground", "type": "static", "group": 2, "mask": -3, "shapes": [{"primitive": "plane"}]},
      {"name": "ball", "type": "dynamic", "mass": 0.5, "group": 1, "mask": -1, "position": [0, 0, 0.1],
       "shapes": [{"primitive": "sphere", "radius": 0.05}]}],
    "apart": []})");
}

TEST(LoadManifest, BodiesHaveTheirNamesAndTheirPlaces) {
  const TemporaryFolder folder;
  Json manifest = simple();
  manifest["bodies"].push_back(Json::parse(R"({"name": "bar", "type": "dynamic", "mass": 2, "group": 1, "mask": -1,
    "position": [1, 0, 1], "orientation": [0, 0, 0.7071067811865476, 0.7071067811865476],
    "centre_of_mass": [0.1, 0, 0], "inertia": [0.01, 0.02, 0.03], "velocity": [0, 3, 0], "restitution": 0.25,
    "shapes": [{"primitive": "capsule", "radius": 0.01, "half_height": 0.1},
               {"primitive": "cylinder", "radius": 0.02, "half_height": 0.05, "position": [0.2, 0, 0]},
               {"primitive": "box", "half_extents": [0.1, 0.2, 0.3], "position": [-0.2, 0, 0]}]})"));
  manifest["bodies"].push_back(
      Json::parse(R"({"name": "lift", "type": "kinematic", "group": 2, "mask": -1, "position": [3, 0, 1],
    "shapes": [{"primitive": "box", "half_extents": [0.1, 0.1, 0.1]}]})"));
  manifest["apart"] = Json::parse(R"([["bar", "ball"]])");
  write_file(folder / "s.json", manifest.dump());
  World world;
  bullet::Scene scene = bullet::load_scene(folder / "s.json", world.world);
  ASSERT_EQ(scene.error(), "");
  EXPECT_EQ(scene.bodies().size(), 4U);
  EXPECT_EQ(world.world.getNumCollisionObjects(), 4);
  EXPECT_NEAR(scene.step(), 0.004, 1e-9);
  EXPECT_EQ(scene.find("nobody"), nullptr);
  EXPECT_NEAR(world.world.getGravity().z(), -10, 1e-6);
  btRigidBody* const bar = scene.find("bar");
  ASSERT_NE(bar, nullptr);
  // A quarter turn about z takes the centre of mass to y.
  EXPECT_LT((bar->getWorldTransform().getOrigin() - btVector3(1, btScalar(0.1), 1)).length(), 1e-6);
  EXPECT_LT((scene.origin(*bar).getOrigin() - btVector3(1, 0, 1)).length(), 1e-6);
  EXPECT_LT((bar->getLocalInertia() - btVector3(btScalar(0.01), btScalar(0.02), btScalar(0.03))).length(), 1e-6);
  EXPECT_NEAR(bar->getLinearVelocity().y(), 3, 1e-6);
  EXPECT_NEAR(bar->getRestitution(), 0.25, 1e-6);
  btVector3 low;
  btVector3 high;
  bar->getAabb(low, high);
  EXPECT_NEAR(high.y(), 0.22, 2e-3);  // the cylinder's far side
  EXPECT_NEAR(low.y(), -0.3, 2e-3);   // the box's
  EXPECT_NEAR(high.z() - low.z(), 0.6, 5e-3);
  EXPECT_FALSE(bar->checkCollideWith(scene.find("ball")));
  EXPECT_TRUE(scene.find("lift")->isKinematicObject());
  world.step(200);
  EXPECT_NEAR(scene.find("ball")->getWorldTransform().getOrigin().z(), 0.05, 2e-3);
  scene = bullet::Scene();
  EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
}

TEST(LoadManifest, StatedProductsOfInertiaTurnTheBody) {
  const TemporaryFolder folder;
  Json manifest = simple();
  // Moments 1, 3 and 4: the first two turned by 45 degrees about z.
  manifest["bodies"][1]["inertia"] = {2, 2, 4, -1, 0, 0};
  manifest["bodies"][1]["centre_of_mass"] = {0.01, 0, 0};
  write_file(folder / "s.json", manifest.dump());
  World world;
  const bullet::Scene scene = bullet::load_scene(folder / "s.json", world.world);
  ASSERT_EQ(scene.error(), "");
  const btRigidBody& ball = *scene.find("ball");
  EXPECT_LT((scene.origin(ball).getOrigin() - btVector3(0, 0, btScalar(0.1))).length(), 1e-6);
  EXPECT_LT((scene.origin(ball).getBasis() * btVector3(1, 0, 0) - btVector3(1, 0, 0)).length(), 1e-6);
  const btMatrix3x3& turn = ball.getWorldTransform().getBasis();
  const btMatrix3x3 tensor = turn.scaled(ball.getLocalInertia()) * turn.transpose();
  const double expected[3][3] = {{2, -1, 0}, {-1, 2, 0}, {0, 0, 4}};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(double(tensor[i][j]), expected[i][j], 1e-5);
  }
  btVector3 low;
  btVector3 high;
  ball.getAabb(low, high);
  EXPECT_NEAR(double(low.x() + high.x()), 0, 1e-6);  // the ball stays where it was
}

// An arm of two bars on a static post: the first turns about z, the second slides out of it. A weight without collision
// geometry hangs on its end.
Json arm() {
  return Json::parse(R"({"format": "vps-scene", "version": 1, "step": 0.004, "assets": [], "bodies": [
      {"name": "post", "type": "static", "group": 2, "mask": -3, "position": [1, 2, 3],
       "shapes": [{"primitive": "box", "half_extents": [0.1, 0.1, 0.5]}]},
      {"name": "upper", "type": "dynamic", "mass": 2, "group": 1, "mask": -1, "position": [1, 2, 3.5],
       "centre_of_mass": [0.5, 0, 0], "inertia": [0.2, 0.3, 0.4, 0.02, 0.01, 0.03],
       "shapes": [{"primitive": "box", "half_extents": [0.5, 0.1, 0.1], "position": [0.5, 0, 0]}]},
      {"name": "fore", "type": "dynamic", "mass": 1, "group": 1, "mask": -1, "position": [2, 2, 3.5],
       "orientation": [0, 0, 0.7071067811865476, 0.7071067811865476],
       "shapes": [{"primitive": "sphere", "radius": 0.1, "position": [0, 0, 0.1]}]},
      {"name": "ball", "type": "dynamic", "mass": 0.5, "group": 1, "mask": -1, "position": [5, 5, 5],
       "shapes": [{"primitive": "sphere", "radius": 0.05}]}],
    "links": [{"name": "weight", "mass": 1, "inertia": [0.1, 0.1, 0.1], "centre_of_mass": [0, 0, -0.1]}],
    "joints": [
      {"name": "turn", "type": "continuous", "parent": "post", "child": "upper", "position": [0, 0, 0.5],
       "axis": [0, 0, 1]},
      {"name": "slide", "type": "prismatic", "parent": "upper", "child": "fore", "position": [1, 0, 0],
       "orientation": [0, 0, 0.7071067811865476, 0.7071067811865476], "axis": [0, -1, 0], "lower": 0, "upper": 0.5},
      {"name": "swing", "type": "revolute", "parent": "fore", "child": "weight", "axis": [1, 0, 0],
       "lower": -1, "upper": 1}],
    "apart": [["post", "upper"], ["upper", "fore"]]})");
}

struct MultibodyWorld {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver solver;
  btMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
};

TEST(LoadManifest, BodiesAtJointsBecomeMultibodiesOnRequest) {
  const TemporaryFolder folder;
  write_file(folder / "s.json", arm().dump());
  MultibodyWorld rigid;
  MultibodyWorld multi;
  const bullet::Scene bodies = bullet::load_scene(folder / "s.json", rigid.world);
  ASSERT_EQ(bodies.error(), "");
  EXPECT_EQ(bodies.bodies().size(), 4U);
  EXPECT_EQ(bodies.find_joint("turn").multibody, nullptr);
  {
    const bullet::Scene robot = bullet::load_scene(folder / "s.json", multi.world, {.multibodies = true});
    ASSERT_EQ(robot.error(), "");
    EXPECT_EQ(robot.bodies().size(), 1U);
    EXPECT_EQ(multi.world.getNumMultibodies(), 1);
    EXPECT_EQ(multi.world.getNumMultiBodyConstraints(), 2);
    EXPECT_EQ(multi.world.getNumCollisionObjects(), 4);
    EXPECT_EQ(robot.find("upper"), nullptr);
    EXPECT_EQ(robot.find_link("weight"), nullptr);
    ASSERT_NE(robot.find_link("fore"), nullptr);
    // At the joints' zeros all stand where the rigid bodies do.
    for (const char* const name : {"post", "upper", "fore"}) {
      const btTransform a = bodies.find(name)->getWorldTransform();
      const btTransform b = robot.find_link(name)->getWorldTransform();
      EXPECT_LT((a.getOrigin() - b.getOrigin()).length(), 1e-6) << name;
      EXPECT_NEAR(double(a.getRotation().dot(b.getRotation())), 1, 1e-6) << name;
    }
    const bullet::JointPlace slide = robot.find_joint("slide");
    ASSERT_NE(slide.multibody, nullptr);
    multi.world.setGravity({0, 0, 0});
    slide.multibody->setJointVel(slide.link, 2);
    for (int i = 0; i < 100; ++i) multi.world.stepSimulation(btScalar(0.01), 0);
    // Its limit stops it, 0.5 m along the upper arm.
    EXPECT_NEAR(double(slide.multibody->getJointPos(slide.link)), 0.5, 0.02);
    EXPECT_NEAR(double((robot.origin(*robot.find_link("fore")).getOrigin() -
                        robot.origin(*robot.find_link("upper")).getOrigin())
                           .length()),
                1.5, 0.02);
  }
  EXPECT_EQ(multi.world.getNumCollisionObjects(), 0);
  EXPECT_EQ(multi.world.getNumMultibodies(), 0);
  EXPECT_EQ(multi.world.getNumMultiBodyConstraints(), 0);
  World plain;
  const bullet::Scene none = bullet::load_scene(folder / "s.json", plain.world, {.multibodies = true});
  EXPECT_EQ(none.error(), (folder / "s.json").string() + ": multibodies need a btMultiBodyDynamicsWorld");
}

TEST(LoadManifest, ForgedJointsAreRefused) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const char* path, const Json& value, const std::string& why) {
    Json manifest = arm();
    manifest[Json::json_pointer(path)] = value;
    write_file(folder / "s.json", manifest.dump());
    for (const bool multibodies : {false, true}) {
      MultibodyWorld world;
      const bullet::Scene scene = bullet::load_scene(folder / "s.json", world.world, {.multibodies = multibodies});
      EXPECT_NE(scene.error().find(why), std::string::npos) << manifest.dump() << ": " << scene.error();
      EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
    }
  };
  expect_refused("/joints", 3, "joints is not a list");
  expect_refused("/joints/0/type", "ball", "joints[0].type is none of");
  expect_refused("/joints/0/parent", "nobody", "joints[0].parent is not the name of a body");
  expect_refused("/joints/0/child", "nobody", "joints[0].child is not the name of a body");
  expect_refused("/joints/0/child", "post", "joints[0].child is held by another joint");
  expect_refused("/joints/0/child", "fore", "joints[1].child is held by another joint");
  expect_refused("/joints/1/child", "post", "joints[1].child is held by another joint");
  expect_refused("/joints/2/parent", "weight", "joints[2].child is held by another joint");
  expect_refused("/joints/1/name", "turn", "joints[1].name is that of another joint");
  expect_refused("/joints/0/axis", {0, 0, 0}, "joints[0].axis is not of unit length");
  expect_refused("/joints/1/upper", -1, "joints[1].upper is not a number");
  expect_refused("/joints/1/axes", 1, "joints[1].axes is not a known key");
  expect_refused("/bodies/1/type", "kinematic", "joints[0].child has no mass");
  expect_refused("/links/0/mass", 0, "links[0].mass is not a number");
  expect_refused("/links/0/name", "post", "links[0].name is that of another body");
  expect_refused("/links/0/shapes", Json::array(), "links[0].shapes is not a known key");

  Json chain = arm();
  for (int i = 0; i < 600; ++i) {
    Json link = chain["links"][0];
    link["name"] = std::to_string(i);
    chain["links"].push_back(link);
    chain["joints"].push_back({{"name", std::to_string(i)},
                               {"type", "continuous"},
                               {"parent", i == 0 ? "weight" : std::to_string(i - 1)},
                               {"child", std::to_string(i)},
                               {"axis", {1, 0, 0}}});
  }
  write_file(folder / "s.json", chain.dump());
  MultibodyWorld world;
  EXPECT_EQ(bullet::load_scene(folder / "s.json", world.world, {.multibodies = true}).error(),
            (folder / "s.json").string() + ": a multibody has more than 512 joints");
}

TEST(LoadManifest, AForgedManifestIsRefusedInOneLine) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const std::string& text, const std::string& why) {
    write_file(folder / "s.json", text);
    World world;
    const bullet::Scene scene = bullet::load_scene(folder / "s.json", world.world);
    EXPECT_NE(scene.error().find(why), std::string::npos) << text << ": " << scene.error();
    EXPECT_EQ(std::count(scene.error().begin(), scene.error().end(), '\n'), 0);
    EXPECT_EQ(world.world.getNumCollisionObjects(), 0);
    EXPECT_TRUE(scene.bodies().empty());
  };
  expect_refused("", "not JSON");
  expect_refused("[]", "not JSON");
  expect_refused(std::string(100000, '['), "not JSON");
  expect_refused(std::string("{\"a\":\0}", 7), "not JSON");
  expect_refused("{}", "format is missing");
  const auto with = [](const char* path, const Json& value) {
    Json manifest = simple();
    manifest[Json::json_pointer(path)] = value;
    return manifest.dump();
  };
  expect_refused(with("/version", 2), "version is not 1");
  expect_refused(with("/step", 0), "step is not a number");
  expect_refused(with("/step", "fast"), "step is not a number");
  expect_refused(with("/assets", 7), "assets is not a list");
  expect_refused(with("/assets", {{{"file", "none.vps.hdf"}, {"use", {"scaled"}}}}), "none.vps.hdf: ");
  expect_refused(with("/assets", {{{"file", "s.json"}, {"use", {"scaled"}}}}), "s.json: ");
  expect_refused(with("/assets", {{{"file", "s.json"}, {"use", {"all"}}}}), "assets[0].use[0] is none");
  expect_refused(with("/bodies", Json::object()), "bodies is not a list");
  expect_refused(with("/bodies/0", nullptr), "bodies[0].name is missing");
  expect_refused(with("/bodies/1/name", "ground"), "bodies[1].name is that of another");
  expect_refused(with("/assets", {{{"file", "no\nfile\x01"}, {"use", {"scaled"}}}}), "no?file?: ");
  const auto with_file = [&](const std::string& name) {
    return with("/assets", {{{"file", name}, {"use", {"scaled"}}}});
  };
  for (const char* const outside : {"/s.json", "../s.json", "a/../../s.json", "a/..", ".."})
    expect_refused(with_file(outside), "assets[0].file leaves the manifest's folder");
  expect_refused(with_file(std::string("a\0b", 3)), "assets[0].file is not the name of a file");
  expect_refused(with_file(""), "assets[0].file is not the name of a file");
  expect_refused(with("/gravty", {0, 0, 0}), "gravty is not a known key");
  expect_refused(with("/bodies/1/postion", {0, 0, 0}), "bodies[1].postion is not a known key");
  expect_refused(with("/bodies/1/shapes/0/raduis", 1), "bodies[1].shapes[0].raduis is not a known key");
  expect_refused(with("/assets", {{{"file", "a"}, {"use", {"scaled"}}, {"hash", ""}}}),
                 "assets[0].hash is not a known");
  expect_refused(with("/bodies/1/name", std::string(1025, 'a')), "bodies[1].name is longer than 1024 bytes");
  expect_refused(with("/bodies", Json(65537, Json::object())), "bodies has more than 65536 entries");
  expect_refused(with("/assets", Json(4097, Json::object())), "assets has more than 4096 entries");
  expect_refused(with("/bodies/1/shapes", Json(1025, Json::object())), "shapes has more than 1024 entries");
  expect_refused(with("/bodies/1/mass", nullptr), "mass is not a number");
  expect_refused(with("/bodies/1/mass", -1), "mass is not a number");
  expect_refused(with("/bodies/1/mass", 1e300), "mass is not a number");
  expect_refused(with("/bodies/1/type", "flying"), "type is none of");
  expect_refused(with("/bodies/1/shapes", Json::array()), "shapes is empty");
  expect_refused(with("/bodies/1/shapes/0/radius", -1), "radius is not a number");
  expect_refused(with("/bodies/1/shapes/0", {{"asset", 0}, {"part", "mixed"}}), "asset is not the number");
  expect_refused(with("/bodies/1/shapes/0", {{"asset", -1}, {"part", "mixed"}}), "asset is out of its range");
  expect_refused(with("/bodies/1/shapes/0", {{"asset", 1e99}, {"part", "mixed"}}), "asset is not a whole");
  expect_refused(with("/bodies/1/shapes/0/primitive", "plane"), "plane that moves");
  expect_refused(with("/bodies/1/inertia", {1, 1}), "inertia has neither three nor six");
  expect_refused(with("/bodies/1/inertia", {1, 1, 0}), "inertia[2] is not a number");
  expect_refused(with("/bodies/1/inertia", {1, 1, 1, 2, 0, 0}), "inertia[3] is not a number");
  expect_refused(with("/bodies/1/inertia", {1, 1, 1, 1, 0, 0}), "inertia has products too large");
  expect_refused(with("/bodies/1/position", {0, 0}), "position has not three");
  expect_refused(with("/bodies/1/position", {0, 0, 1e30}), "position[2] is not a number");
  expect_refused(with("/bodies/1/orientation", {0, 0, 0, 0}), "orientation is not of unit length");
  expect_refused(with("/bodies/1/group", 4294967296), "group is out of its range");
  expect_refused(with("/bodies/1/group", 18446744073709551615ull), "group is out of its range");
  expect_refused(with("/bodies/1/restitution", 2), "restitution is not a number");
  expect_refused(with("/apart", Json::array({Json::array({"ball", "ball"})})), "apart[0] does not name two");
  expect_refused(with("/apart", Json::array({Json::array({"ball", 3})})), "apart[0][1] is not a text");
  expect_refused(with("/gravity", {0, 0, "down"}), "gravity[2]");
  std::string infinite = simple().dump();
  infinite.replace(infinite.find("0.004"), 5, "1e999");
  expect_refused(infinite, "not JSON");
  // A truncated manifest is not JSON. A manifest with a changed byte is refused or is another scene. Nothing crashes.
  const std::string good = simple().dump();
  for (std::size_t size = 0; size < good.size(); size += 7) expect_refused(good.substr(0, size), "not JSON");
  for (std::size_t i = 0; i < good.size(); i += 5) {
    for (const char c : {'\0', '9', '"', '-'}) {
      std::string changed = good;
      changed[i] = c;
      write_file(folder / "s.json", changed);
      World world;
      const bullet::Scene scene = bullet::load_scene(folder / "s.json", world.world);
      world.step(1);
    }
  }
  World world;
  std::filesystem::resize_file(folder / "s.json", (std::uintmax_t{1} << 26) + 1);
  EXPECT_EQ(bullet::load_scene(folder / "s.json", world.world).error(),
            (folder / "s.json").string() + ": the manifest is larger than 64 MiB");
  EXPECT_NE(bullet::load_scene(folder / "none.json", world.world).error(), "");
  EXPECT_NE(bullet::load_scene(folder.path(), world.world).error(), "");
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes from URDFs.
#include <cmath>

#include "runtime/vps_runtime.h"
#include "tests/cli/scene/scene_plan.h"
#include "tests/support/shared.h"

namespace vps::test {
namespace {

// A carriage with a peg fixed to it hangs over a block; the finger hinges on the carriage.
std::string robot(const std::string& of_peg) {
  return R"(<?xml version="0.0" ?>
<robot name="press">stray
  <link name="world"/>
  <link name="block"><collision><geometry><mesh filename=")" +
         sample("hole") + R"("/></geometry></collision></link>
  <link name="ram">
    <inertial><origin xyz="0 0 0.1"/><mass value="3"/>
      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.3" iyz="0" izz="0.4"/></inertial>
    <collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>
  </link>
  <link name="peg">
    <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><geometry>
      )" +
         of_peg +
         R"(
    </geometry></collision>
  </link>
  <link name="finger">
    <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
    <collision><geometry><sphere radius="0.01"/></geometry></collision>
  </link>
  <joint name="a" type="fixed"><parent link="world"/><child link="block"/></joint>
  <joint name="b" type="prismatic"><parent link="world"/><child link="ram"/><origin xyz="0 0 1"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <joint name="c" type="fixed"><parent link="ram"/><child link="peg"/><origin xyz="0 0 -0.1" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="d" type="continuous"><parent link="ram"/><child link="finger"/><axis xyz="0 0 1"/></joint>
</robot>
)";
}

TEST(Urdf, LinksThatFixedJointsHoldAreOneBodyAndJoinedBodiesDoNotMeet) {
  const TemporaryFolder folder;
  write_file(folder / "press.urdf", robot("<mesh filename=\"" + sample("peg") + "\" scale=\"2 2 2\"/>"));
  const Outcome run = vpsbake(folder, "scene press.urdf -o out --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json report = Json::parse(run.out);
  ASSERT_EQ(report["bodies"].size(), 3U);
  EXPECT_EQ(report["bodies"][0]["name"], "world");
  EXPECT_EQ(report["bodies"][0]["type"], "static");
  EXPECT_EQ(report["bodies"][0]["meets"], Json({"ram", "finger"}));
  EXPECT_EQ(report["bodies"][1]["meets"], Json({"world"}));
  const Json manifest = Json::parse(read_file(folder / "out/press.vps.json"));
  EXPECT_EQ(manifest["apart"], Json::array({{"ram", "finger"}}));
  const Json& ram = manifest["bodies"][1];
  EXPECT_EQ(ram["mass"], 4.0);
  // 3 kg at 0.1 m and 1 kg at -0.1 m: the centre of mass is at 50 mm, and the inertia across grows by 0.03 kg m^2.
  EXPECT_NEAR(ram["centre_of_mass"][2].get<double>(), 0.05, 1e-12);
  EXPECT_NEAR(ram["inertia"][0].get<double>(), 0.3 + 3 * 0.05 * 0.05 + 0.15 * 0.15, 1e-12);
  EXPECT_NEAR(ram["inertia"][2].get<double>(), 0.5, 1e-12);
  EXPECT_EQ(ram["inertia"].size(), 3U);
  EXPECT_EQ(ram["position"][2], 1.0);
  ASSERT_EQ(ram["shapes"].size(), 2U);
  EXPECT_EQ(ram["shapes"][0]["half_extents"], Json({0.05, 0.1, 0.15}));
  EXPECT_EQ(ram["shapes"][1]["part"], "voxelmap");  // twice as large, it has coarser voxels than the block
  EXPECT_NEAR(ram["shapes"][1]["position"][2].get<double>(), -0.1, 1e-12);
  EXPECT_NEAR(ram["shapes"][1]["orientation"][2].get<double>(), std::sqrt(0.5), 1e-12);
  Asset peg;
  ASSERT_EQ(Asset::open(asset_at(folder, "out", report, 1).c_str(), peg), Status::ok);
  EXPECT_NEAR(peg.info().bounds_max[0], 2 * 0.0039, 1e-6);
}

TEST(Urdf, JointsOfOneAxisAreInTheManifest) {
  const TemporaryFolder folder;
  std::string text = robot("<mesh filename=\"" + sample("peg") + "\"/>");
  // A weight without collision geometry hangs on the finger.
  text.replace(text.find("</robot>"), 8, R"(
  <link name="weight"><inertial><origin xyz="0 0 -0.1"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.3"/></inertial></link>
  <joint name="e" type="revolute"><parent link="finger"/><child link="weight"/><origin xyz="0.5 0 0"/>
    <axis xyz="0 3 4"/><limit lower="-1" upper="2" effort="1" velocity="1"/></joint>
</robot>)");
  write_file(folder / "press.urdf", text);
  write_file(folder / "scene.toml",
             "[[body]]\nname = \"p\"\nurdf = \"press.urdf\"\nposition = [\"1m\", \"0m\", \"0m\"]\n");
  ASSERT_EQ(vpsbake(folder, "scene press.urdf -o alone").code, 0);
  ASSERT_EQ(vpsbake(folder, "scene scene.toml -o named").code, 0);
  const Json alone = Json::parse(read_file(folder / "alone/press.vps.json"));
  EXPECT_EQ(alone["joints"], Json::parse(R"([
    {"name": "b", "type": "prismatic", "parent": "world", "child": "ram", "position": [0.0, 0.0, 1.0],
     "axis": [0.0, 0.0, 1.0], "lower": 0.0, "upper": 1.0},
    {"name": "d", "type": "continuous", "parent": "ram", "child": "finger", "axis": [0.0, 0.0, 1.0]},
    {"name": "e", "type": "revolute", "parent": "finger", "child": "weight", "position": [0.5, 0.0, 0.0],
     "axis": [0.0, 0.6, 0.8], "lower": -1.0, "upper": 2.0}])"));
  EXPECT_EQ(alone["links"], Json::parse(R"([
    {"name": "weight", "mass": 2.0, "inertia": [0.1, 0.2, 0.3], "centre_of_mass": [0.0, 0.0, -0.1]}])"));
  const Json named = Json::parse(read_file(folder / "named/scene.vps.json"));
  EXPECT_EQ(named["joints"][2]["name"], "p/e");
  EXPECT_EQ(named["joints"][2]["parent"], "p/finger");
  EXPECT_EQ(named["links"][0]["name"], "p/weight");
}

// A gantry: its root has neither shape nor mass.
TEST(Urdf, AJointWithoutAParentStandsInTheWorld) {
  const TemporaryFolder folder;
  write_file(folder / "g.urdf", R"(<robot name="g"><link name="world"/>
  <link name="ball"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="j" type="prismatic"><parent link="world"/><child link="ball"/><origin xyz="0 0 2"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>)");
  write_file(folder / "scene.toml", "[[body]]\nname = \"g\"\nurdf = \"g.urdf\"\nposition = [\"1m\", \"0m\", \"0m\"]\n");
  ASSERT_EQ(vpsbake(folder, "scene scene.toml -o out").code, 0);
  const Json joint = Json::parse(read_file(folder / "out/scene.vps.json"))["joints"][0];
  EXPECT_FALSE(joint.contains("parent"));
  EXPECT_EQ(joint["position"], Json({1.0, 0.0, 2.0}));
  EXPECT_EQ(joint["child"], "g");
}

TEST(Urdf, NothingToBakeIsSaid) {
  const TemporaryFolder folder;
  write_file(folder / "nut.urdf", "<robot name=\"r\"><link name=\"nut\"><collision><geometry><mesh filename=\"" +
                                      sample("nut") + "\"/></geometry></collision></link></robot>");
  const Outcome run = vpsbake(folder, "scene nut.urdf -o out");
  EXPECT_EQ(run.code, 0);
  EXPECT_NE((run.out + run.err).find("nothing is baked: no body has a mass"), std::string::npos) << run.out << run.err;
}

TEST(Urdf, AUrdfThatCannotBeUsedIsRefusedWithItsLine) {
  const TemporaryFolder folder;
  const auto expect_urdf_refused = [&](const std::string& text, const std::string& why, int code = kBad) {
    write_file(folder / "r.urdf", text);
    expect_refusal(folder, "scene r.urdf", code, why);
  };
  expect_urdf_refused("", "r.urdf:1: this is not XML");
  expect_urdf_refused("<robot name=\"a\">\n<link name=\"b\">\n</robot>", "r.urdf:3: this is not XML");
  std::string deep;
  for (int i = 0; i < 1'000'000; ++i) deep += "<a>";
  expect_urdf_refused(deep, "r.urdf:1: the elements are nested too deeply");
  expect_urdf_refused("<html/>", "r.urdf:1: this is not a URDF: it has no <robot>");
  expect_urdf_refused("<robot name=\"a\"/>", "r.urdf:1: this is not a URDF");
  expect_urdf_refused("<robot name=\"a\"><link name=\"b\"/></robot>", "no link has collision geometry");
  expect_urdf_refused(robot("<mesh filename=\"none.obj\"/>"), "r.urdf:13: mesh 'none.obj': the file does not exist",
                      kMissing);
  expect_urdf_refused(robot("<mesh filename=\"package://none/none.obj\"/>"),
                      "r.urdf:13: mesh 'package://none/none.obj'", kMissing);
  expect_urdf_refused(robot("<mesh filename=\"model://arm/none.obj\"/>"), "r.urdf:13: mesh 'model://arm/none.obj'",
                      kMissing);
  expect_urdf_refused(robot("<mesh filename=\"a.obj\" scale=\"1 0 1\"/>"),
                      "r.urdf:13: the mesh's unit and scale make less than 1e-9");
  std::string light = robot("<sphere radius=\"1\"/>");
  light.replace(light.find("<mass value=\"3\""), 15, "<mass value=\"-1\"");
  expect_urdf_refused(light, "r.urdf:5: link 'ram' has a negative mass or moment of inertia");
  std::string spun = robot("<sphere radius=\"1\"/>");
  spun.replace(spun.find("iyy=\"0.3\""), 9, "iyy=\"-9\"");
  expect_urdf_refused(spun, "r.urdf:5: link 'ram' has a negative mass or moment of inertia");
  expect_urdf_refused(robot("<sphere radius=\"-1\"/>"), "r.urdf:13: a size of this shape is below 2 nm");
  // Errors that urdfdom reports without a line number.
  expect_urdf_refused(robot("<sphere radius=\"wide\"/>"), "r.urdf:10: this is not a URDF that can be used: ");
  expect_urdf_refused(robot("<capsule radius=\"1\" length=\"1\"/>"), "this is not a URDF that can be used: ");
  expect_urdf_refused(robot("<capsule radius=\"1\" length=\"1\"/>"),
                      "; a URDF has meshes, boxes, spheres and cylinders");
  const auto with = [&](const std::string& old, const std::string& text) {
    std::string whole = robot("<sphere radius=\"1\"/>");
    return whole.replace(whole.find(old), old.size(), text);
  };
  expect_urdf_refused(with("<child link=\"block\"/>", "<child link=\"blok\"/>"), "r.urdf:20: this is not a URDF");
  expect_urdf_refused(with("<link name=\"finger\">", "<link name=\"ram\">"), "r.urdf:5: this is not a URDF");
  // Errors that urdfdom ignores.
  expect_urdf_refused(with("<collision><geometry><box size=\"0.1 0.2 0.3\"/></geometry></collision>", "<colision/>"),
                      "r.urdf:8: <link> has no <colision>; did you mean <collision>?");
  expect_urdf_refused(with("<link name=\"world\"/>", "<link name=\"world\"/><xacro:arm side=\"left\"/>"),
                      "r.urdf:3: <xacro:arm>: this is a xacro file");
  expect_urdf_refused(with("<link name=\"world\"/>", "<link name=\"world\"/><jiont/>"),
                      "r.urdf:3: <robot> has no <jiont>");
  expect_urdf_refused(with("<origin xyz=\"0 0 1\"/>", "<orign xyz=\"0 0 1\"/>"), "r.urdf:21: <joint> has no <orign>");
  expect_urdf_refused(with("<origin xyz=\"0 0 1\"/>", "<origin xzy=\"0 0 1\"/>"),
                      "r.urdf:21: <origin> has no xzy; did");
  expect_urdf_refused(robot("<mesh filename=\"a.obj\" scael=\"2 2 2\"/>"), "r.urdf:13: <mesh> has no scael; did you");
  expect_urdf_refused(robot("<cylinder radius=\"1\"/>"), "r.urdf:13: <cylinder> needs radius, length");
  expect_urdf_refused(robot("<mesh filename=\"m\xE9sh.obj\"/>"), "r.urdf:13: this is not a text in UTF-8");
  expect_urdf_refused(robot("<mesh filename=\"a&#10;b.obj\"/>"), "r.urdf:13: the mesh is not the name of a file");
}

// What load_scene would refuse is refused before anything is baked.
TEST(Urdf, WhatNoManifestCanHoldIsRefused) {
  const TemporaryFolder folder;
  const auto expect_refused = [&](const std::string& old, const std::string& text, const std::string& why) {
    std::string whole = robot("<sphere radius=\"1\"/>");
    write_file(folder / "r.urdf", whole.replace(whole.find(old), old.size(), text));
    expect_refusal(folder, "scene r.urdf --dry-run", kBad, why);
  };
  expect_refused("ixx=\"0.2\" ixy=\"0\" ixz=\"0\" iyy=\"0.3\" iyz=\"0\" izz=\"0.4\"",
                 "ixx=\"1e10\" ixy=\"0\" ixz=\"0\" iyy=\"1e10\" iyz=\"0\" izz=\"1e10\"",
                 "r.urdf:5: the inertia of 'ram' is out of range");
  expect_refused("<mass value=\"3\"", "<mass value=\"1e10\"", "r.urdf:5: 'ram' has 1e+10 kg");
  expect_refused("<joint name=\"d\"", "<joint name=\"" + std::string(1025, 'd') + "\"",
                 "r.urdf:16: a joint's name is longer than 1024 bytes");
  const std::string finger = "<collision><geometry><sphere radius=\"0.01\"/></geometry></collision>\n  ";
  const std::string held =
      "<mass value=\"1\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" "
      "izz=\"0.1\"/></inertial>\n    ";
  expect_refused(held + finger,
                 "<mass value=\"1e-12\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" "
                 "izz=\"0.1\"/></inertial>",
                 "r.urdf:16: the mass of 'finger' is out of range");

  // Names that bodies of a TOML share with links of a URDF.
  write_file(folder / "r.urdf", robot("<sphere radius=\"1\"/>"));
  write_file(folder / "s.toml", "[[body]]\nname = \"r\"\nurdf = \"r.urdf\"\n" + body("r/ram", "nut", "mass = \"1g\""));
  expect_refusal(folder, "scene s.toml --dry-run", kBad,
                 "two bodies are named 'r/ram', the other on line 5; rename one");
  write_file(folder / "s.toml", std::string("[world]\ngravity = [\"0m/s2\", \"0m/s2\", \"-1e7m/s2\"]\n") + kPlane);
  expect_refusal(folder, "scene s.toml --dry-run", kBad, "s.toml:2: gravity is beyond 1e+06 m/s^2");
}

TEST(Urdf, JointsThatCannotMoveOrTurnAreLeftOutAndEndlessLimitsAreCut) {
  const TemporaryFolder folder;
  const std::string whole = robot("<sphere radius=\"1\"/>");
  std::string printed;
  const auto joints = [&](const std::string& old, const std::string& text, const std::string& type = "") {
    std::string changed = whole;
    write_file(folder / "r.urdf", changed.replace(changed.find(old), old.size(), text));
    write_file(folder / "s.toml", "[[body]]\nname = \"r\"\nurdf = \"r.urdf\"\n" + type);
    const Outcome run = vpsbake(folder, "scene s.toml -o out");
    EXPECT_EQ(run.code, 0) << run.err;
    printed = run.out;
    const Json manifest = Json::parse(read_file(folder / "out/s.vps.json"));
    return manifest.contains("joints") ? manifest["joints"] : Json::array();
  };
  EXPECT_EQ(joints("0 0 1", "0 0 1").size(), 2U);
  EXPECT_EQ(joints("0 0 1", "0 0 1", "type = \"static\"\n").size(), 0U);
  EXPECT_EQ(joints("<axis xyz=\"0 0 1\"/><limit", "<axis xyz=\"0 0 0\"/><limit").size(), 1U);
  const Json endless = joints("lower=\"0\" upper=\"1\"", "lower=\"-1e16\" upper=\"1e16\"");
  EXPECT_EQ(endless[0]["lower"], -1e9);
  EXPECT_EQ(endless[0]["upper"], 1e9);
  EXPECT_NE(printed.find("has limits of -1e+16 and 1e+16: they are -1e+09 and 1e+09"), std::string::npos) << printed;
  EXPECT_EQ(joints("type=\"prismatic\"", "type=\"planar\"").size(), 1U);
  EXPECT_NE(printed.find("' is left out: its type is not supported"), std::string::npos) << printed;
  EXPECT_EQ(joints("<axis xyz=\"0 0 1\"/><limit", "<axis xyz=\"0 0 1\"/><mimic joint=\"e\"/><limit").size(), 2U);
  EXPECT_NE(printed.find("' mimics 'e', which is not read: it moves by itself"), std::string::npos) << printed;
  const std::string pan =
      "<link name=\"pan\"/><joint name=\"p\" type=\"continuous\"><parent link=\"ram\"/><child link=\"pan\"/>"
      "<axis xyz=\"1 0 0\"/></joint>";
  EXPECT_EQ(joints("<joint name=\"d\"", pan + "<joint name=\"d\"").size(), 2U);
  EXPECT_NE(printed.find("joint 'p' is left out: link 'pan' has neither shape nor mass"), std::string::npos) << printed;
  EXPECT_EQ(joints("izz=\"0.4\"", "izz=\"4\"").size(), 2U);
  EXPECT_NE(printed.find("link 'ram' has moments of inertia that no body has"), std::string::npos) << printed;
  const Json turned = joints("lower=\"0\" upper=\"1\"", "lower=\"1\" upper=\"0\"");
  EXPECT_FALSE(turned[0].contains("lower"));
}

// The system follows a link before "..".
TEST(Urdf, FilesAreFoundThroughLinksOfFolders) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "other/sub");
  std::filesystem::create_directory_symlink("other/sub", folder / "link");
  std::filesystem::copy_file(sample("nut"), folder / "m.obj");
  std::filesystem::copy_file(sample("cube"), folder / "other/m.obj");
  const std::string text =
      "<robot name=\"r\"><link name=\"l\"><collision><geometry>\n<mesh filename=\"m.obj\"/>"
      "</geometry></collision></link></robot>";
  write_file(folder / "other/r.urdf", text);
  write_file(folder / "other/s.toml", "[[body]]\nname = \"a\"\nmesh = \"m.obj\"\ntype = \"static\"\n");
  write_file(folder / "t.toml", "[[body]]\nname = \"a\"\nmesh = \"link/../m.obj\"\ntype = \"static\"\n");
  for (const char* scene : {"link/../r.urdf", "link/../s.toml", "t.toml"}) {
    const Outcome run = vpsbake(folder, std::string("scene ") + scene + " --dry-run --json");
    ASSERT_EQ(run.code, 0) << run.err;
    // A two-hundredth of the cube; the nut is smaller.
    EXPECT_EQ(Json::parse(run.out)["assets"][0]["voxel_size"], 0.0005) << scene;
  }
}

TEST(Urdf, WhatAUrdfHasBesidesIsSaidOnce) {
  const TemporaryFolder folder;
  write_file(folder / "r.urdf", R"(<robot name="r" xmlns:sim="http://sim">
  <gazebo/><material name="white"><color rgba="1 1 1 1"/></material><sim:thing/>
  <link name="a"><visual><geometry><sphere radius="1"/></geometry><anything/></visual><contact/><collision><sdf resolution="256"/>
    <geometry><sphere radius="1"/></geometry></collision></link>
  <link name="b"><contact/></link>
  <joint name="j" type="floating" sim:x="1"><parent link="a"/><child link="b"/></joint>
</robot>)");
  const Outcome run = vpsbake(folder, "scene r.urdf --dry-run --json");
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(Json::parse(run.out)["notes"],
            Json({"r.urdf:3: <contact> in <link> is left out", "r.urdf:3: <sdf> in <collision> is left out",
                  "link 'a' has no mass: it is static"}));
}

TEST(Urdf, AUrdfWhoseJointsGoRoundInACircleIsRefused) {
  const TemporaryFolder folder;
  const auto expect_joints_refused = [&](std::initializer_list<std::pair<const char*, const char*>> joints,
                                         const std::string& why) {
    std::string text = "<robot name=\"a\">\n";
    for (const char* const link : {"r", "x", "y"}) {
      text += std::string("<link name=\"") + link +
              "\"><collision><geometry><sphere radius=\"1\"/></geometry></collision></link>\n";
    }
    for (const auto& [parent, child] : joints) {
      text += std::string("<joint name=\"") + parent + child + "\" type=\"fixed\"><parent link=\"" + parent +
              "\"/><child link=\"" + child + "\"/></joint>\n";
    }
    write_file(folder / "r.urdf", text + "</robot>");
    expect_refusal(folder, "scene r.urdf", kBad, why);
  };
  expect_joints_refused({{"r", "x"}, {"x", "y"}, {"y", "x"}}, "r.urdf:3: link 'x' is the child of two joints");
  expect_joints_refused({{"x", "y"}, {"y", "x"}}, "r.urdf:3: link 'x' does not hang on the root 'r'");
  expect_joints_refused({{"r", "x"}, {"y", "y"}}, "r.urdf:4: link 'y' does not hang on the root 'r'");
}

TEST(Urdf, AChainOfTooManyLinksIsRefused) {
  const TemporaryFolder folder;
  std::string text = "<robot name=\"a\"><link name=\"0\"/>";
  for (int i = 1; i <= 1000; ++i) {
    text += "<link name=\"" + std::to_string(i) + "\"/><joint name=\"j" + std::to_string(i) +
            "\" type=\"fixed\"><parent link=\"" + std::to_string(i - 1) + "\"/><child link=\"" + std::to_string(i) +
            "\"/></joint>";
  }
  write_file(folder / "r.urdf", text + "</robot>");
  expect_refusal(folder, "scene r.urdf", 3, "link '1000' hangs on a chain of more than 1000 links");
}

TEST(Urdf, ATomlTakesBodiesFromAUrdf) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "robots/meshes");
  std::filesystem::copy_file(sample("nut"), folder / "robots/meshes/nut.obj");
  write_file(folder / "robots/nut.urdf",
             "<robot name=\"r\"><link name=\"l\"><collision><geometry>\n"
             "<mesh filename=\"package://robots/meshes/nut.obj\"/></geometry></collision></link></robot>");
  const Json report = plan(folder, kPlane + std::string("[[body]]\nname = \"nut\"\nurdf = \"robots/nut.urdf\"\n"
                                                        "mass = \"20g\"\nposition = [\"0m\", \"0m\", \"1m\"]\n"));
  EXPECT_EQ(report["bodies"][1]["name"], "nut");
  EXPECT_EQ(report["bodies"][1]["type"], "dynamic");
  EXPECT_EQ(report["bodies"][1]["meets"], Json({"ground"}));
}

std::string link(const std::string& name, const std::string& mesh) {
  return "<link name=\"" + name + R"("><inertial><mass value="0.1"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><geometry><mesh filename=")" +
         mesh + R"("/></geometry></collision></link>)";
}

TEST(Urdf, APackageIsNotTakenForAnotherOne) {
  const TemporaryFolder folder;
  for (const char* const at : {"hand/meshes", "arm/meshes", "arm/urdf"}) {
    std::filesystem::create_directories(folder / "ws" / at);
  }
  std::filesystem::copy_file(sample("cube"), folder / "ws/arm/meshes/link.obj");
  std::filesystem::copy_file(sample("nut"), folder / "ws/hand/meshes/link.obj");
  write_file(folder / "ws/arm/urdf/r.urdf",
             "<robot name=\"r\">" + link("l", "package://hand/meshes/link.obj") + "</robot>");
  const std::string scene = kPlane + std::string("[[body]]\nname = \"l\"\nurdf = \"ws/arm/urdf/r.urdf\"\n");
  const auto package_in = [](const Json& report) {
    return std::filesystem::path(report["assets"][0]["mesh"].get<std::string>()).parent_path().parent_path().filename();
  };
  EXPECT_EQ(package_in(plan(folder, scene)), "hand") << "arm has a mesh of this name too, and is nearer";
  std::filesystem::remove_all(folder / "ws/hand");
  const Json guessed = plan(folder, scene);
  EXPECT_EQ(package_in(guessed), "arm");
  EXPECT_NE(guessed["notes"].dump().find("package 'hand' is taken to be the folder '"), std::string::npos);
  write_file(folder / "ws/arm/package.xml", "<package><name>hand</name></package>");
  const Json named = plan(folder, scene);
  EXPECT_EQ(package_in(named), "arm");
  EXPECT_EQ(named["notes"].dump().find("package 'hand'"), std::string::npos);
  write_file(folder / "ws/arm/package.xml", "<package><name>arm</name></package>");
  expect_refusal(folder, "scene scene.toml", kMissing, "mesh 'package://hand/meshes/link.obj'");
}

TEST(Urdf, APackageIsFoundWhereRosLooks) {
  const TemporaryFolder folder;
  write_file(folder / "r.urdf", "<robot name=\"r\">" + link("l", "package://hand/meshes/link.obj") + "</robot>");
  const std::string scene = kPlane + std::string("[[body]]\nname = \"l\"\nurdf = \"r.urdf\"\n");
  const auto put = [&](const std::string& package) {
    std::filesystem::create_directories(folder / package / "meshes");
    std::filesystem::copy_file(sample("cube"), folder / package / "meshes/link.obj");
    return (folder / package / "meshes/link.obj").string();
  };
  const auto mesh = [&](const char* variable, const std::string& value) {
    ::setenv(variable, value.c_str(), 1);
    const Json report = plan(folder, scene);
    ::unsetenv(variable);
    return report["assets"][0]["mesh"].get<std::string>();
  };
  const std::string root = folder.path().string();
  const std::string in_install = put("install/share/hand");
  EXPECT_EQ(mesh("AMENT_PREFIX_PATH", root + "/none:" + root + "/install"), in_install);
  const std::string in_repository = put("src/robots/hand");
  EXPECT_EQ(mesh("ROS_PACKAGE_PATH", root + "/src"), in_repository);
  EXPECT_EQ(mesh("ROS_PACKAGE_PATH", root + "/src/robots"), in_repository);
  const std::string in_clone = put("src/hand_v2");
  write_file(folder / "src/hand_v2/package.xml", "<package><name>hand</name></package>");
  EXPECT_EQ(mesh("ROS_PACKAGE_PATH", root + "/src/hand_v2"), in_clone);
  ::setenv("AMENT_PREFIX_PATH", (root + "/src").c_str(), 1);
  expect_refusal(folder, "scene scene.toml", kMissing, "mesh 'package://hand/meshes/link.obj'");
  ::unsetenv("AMENT_PREFIX_PATH");
}

TEST(Urdf, AScaleMayStretchAndMirror) {
  const TemporaryFolder folder;
  write_file(folder / "corner.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  write_file(folder / "r.urdf", "<robot name=\"r\">" + link("l", "corner.obj\" scale=\"0.1 -0.2 0.3") + "</robot>");
  const Json report = plan(folder, kPlane + std::string("[[body]]\nname = \"l\"\nurdf = \"r.urdf\"\n"), "-o out");
  EXPECT_EQ(report["assets"][0]["notes"].dump().find("inside out"), std::string::npos);
  Asset asset;
  ASSERT_EQ(Asset::open(asset_at(folder, "out", report, 0).c_str(), asset), Status::ok);
  const AssetInfo& info = asset.info();
  EXPECT_EQ(info.bounds_min, (std::array{0.0, -0.2, 0.0}));
  EXPECT_EQ(info.bounds_max, (std::array{0.1, 0.0, 0.3}));
  EXPECT_NEAR(info.volume, 0.1 * 0.2 * 0.3 / 6, 1e-9);
  EXPECT_NEAR(info.centre_of_mass[1], -0.05, 1e-9);
}

TEST(Urdf, AFileAddressMayHaveItsSpacesAsCodes) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(sample("cube"), folder / "a link%.obj");
  write_file(folder / "r.urdf",
             "<robot name=\"r\">" + link("l", "file://" + (folder / "a%20link%.obj").string()) + "</robot>");
  const Json report = plan(folder, kPlane + std::string("[[body]]\nname = \"l\"\nurdf = \"r.urdf\"\n"));
  EXPECT_EQ(std::filesystem::path(report["assets"][0]["mesh"].get<std::string>()).filename(), "a link%.obj");
}

// Robots have links without geometry, to which the next one is joined.
TEST(Urdf, ParentAndChildOfAJointThatHangsOnAFrameDoNotMeet) {
  const TemporaryFolder folder;
  write_file(folder / "r.urdf", "<robot name=\"r\">" + link("upper", sample("gear")) + link("fore", sample("gear")) +
                                    R"(<link name="elbow"/>
  <joint name="f" type="fixed"><parent link="upper"/><child link="elbow"/></joint>
  <joint name="j" type="continuous"><parent link="elbow"/><child link="fore"/><origin xyz="0.03 0 0"/>
    <axis xyz="0 0 1"/></joint></robot>)");
  const Json report = plan(folder, kPlane + std::string("[[body]]\nname = \"r\"\nurdf = \"r.urdf\"\n"));
  EXPECT_EQ(report["pairs_that_meet"], 2) << "each meets the plane alone";
}

TEST(Urdf, AnInertiaOfZeroIsNoted) {
  const TemporaryFolder folder;
  std::string text = "<robot name=\"r\">" + link("l", sample("gear")) + "</robot>";
  for (std::size_t at; (at = text.find("1e-4")) != std::string::npos;) text.replace(at, 4, "0");
  write_file(folder / "r.urdf", text);
  const Json report = plan(folder, kPlane + std::string("[[body]]\nname = \"r\"\nurdf = \"r.urdf\"\n"));
  EXPECT_NE(report["notes"].dump().find("moment of inertia of 0"), std::string::npos);
  expect_refusal(folder, "r.urdf", kBad, "scenes and robots are for `vpsbake scene`");
}

TEST(Urdf, RealUrdfsAreRead) {
  VPS_SHARED_FILE_OR_SKIP(scenes, "scenes");
  const TemporaryFolder folder;
  std::string text = kPlane;
  for (const char* const name : {"Banana", "Scissors", "PowerDrill"}) {
    text += std::string("[[body]]\nname = \"") + name + "\"\nurdf = \"" + scenes.string() +
            "/ycb_tabletop/ycb_objects/Ycb" + name + "/model.urdf\"\n";
  }
  text += "[[body]]\nname = \"nut\"\nmass = \"30g\"\nurdf = \"" + scenes.string() +
          "/factory/urdf/factory_nut_m16_loose.urdf\"\n";
  const Json report = plan(folder, text);
  EXPECT_EQ(report["pairs_that_meet"], 10);
}

}  // namespace
}  // namespace vps::test

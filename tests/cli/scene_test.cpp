// SPDX-License-Identifier: GPL-3.0-or-later
// Planning of scenes, as a user sees it: who meets whom, who plays what, and what is refused before baking.
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "runtime/vps_runtime.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"
#include "tests/support/shared.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// One [[body]] with a sample mesh.
std::string body(const std::string& name, const char* mesh, const std::string& rest) {
  return "[[body]]\nname = \"" + name + "\"\nmesh = \"" + sample(mesh) + "\"\n" + rest + "\n";
}

constexpr const char* kPlane = "[[body]]\nname = \"ground\"\nshape = \"plane\"\ntype = \"static\"\n";

Json plan(const TemporaryFolder& folder, const std::string& text, const std::string& options = "--dry-run") {
  write_file(folder / "scene.toml", text);
  const Outcome run = vpsbake(folder, "scene scene.toml --json " + options);
  EXPECT_EQ(run.code, 0) << run.err;
  return run.code == 0 ? Json::parse(run.out) : Json();
}

std::string plays(const Json& report, std::size_t number) {
  return report["bodies"][number]["shapes"][0]["plays"];
}

std::filesystem::path asset_at(const TemporaryFolder& folder, const char* output, const Json& report,
                               std::size_t number) {
  return std::filesystem::path(folder / output) / report["assets"][number]["file"].get<std::string>();
}

constexpr int kMissing = 2;
constexpr int kBad = 3;

void expect_scene_refused(const TemporaryFolder& folder, const std::string& text, const std::string& why,
                          int code = kBad) {
  write_file(folder / "scene.toml", text);
  expect_refusal(folder, "scene scene.toml", code, why);
}

TEST(Scene, BodiesPlayWhatTheirPairsAskFor) {
  const TemporaryFolder folder;
  const Json report =
      plan(folder, kPlane + body("bolt", "bolt", "type = \"static\"") + body("nut", "nut", "mass = \"20g\"") +
                       body("post", "peg", "type = \"static\"") + body("lift", "cube", "type = \"kinematic\""));
  // Static and kinematic bodies do not meet each other.
  EXPECT_EQ(report["pairs"], 10);
  EXPECT_EQ(report["pairs_that_meet"], 4);
  EXPECT_EQ(report["bodies"][2]["meets"], Json({"ground", "bolt", "post", "lift"}));
  // The peg has fewer points than the nut, the others more.
  EXPECT_EQ(plays(report, 1), "voxelmap");
  EXPECT_EQ(plays(report, 2), "mixed");
  EXPECT_EQ(plays(report, 3), "pointshell");
  EXPECT_EQ(plays(report, 4), "voxelmap");
  EXPECT_EQ(report["assets"][0]["left_out"], Json({"pointshell", "layers", "real"}));
  EXPECT_LT(report["planned"]["bytes"], report["everything"]["bytes"]);
  EXPECT_TRUE(folder.names().size() == 1) << "a dry run writes nothing";
}

TEST(Scene, MasksDecideWhoMeets) {
  const TemporaryFolder folder;
  const Json report = plan(folder, kPlane + body("a", "nut", "mass = \"20g\"\ngroup = 4\nmask = 2") +
                                       body("b", "gear", "mass = \"20g\"\ngroup = 8\nmask = 2") +
                                       body("c", "torus", "mass = \"20g\"\nmask = 0"));
  EXPECT_EQ(report["pairs_that_meet"], 2);
  EXPECT_EQ(plays(report, 1), "pointshell");
  EXPECT_EQ(plays(report, 2), "pointshell");
  EXPECT_EQ(plays(report, 3), "nothing");
  EXPECT_TRUE(report["assets"][2]["file"].is_null());
}

TEST(Scene, BodiesWithOneMeshShareAnAssetAndItsTwoParts) {
  const TemporaryFolder folder;
  const Json report = plan(folder, body("a", "nut", "mass = \"20g\"") + body("b", "nut", "mass = \"10g\"") +
                                       body("large", "nut", "mass = \"1kg\"\nscale = 3"));
  EXPECT_EQ(report["assets"].size(), 2U);
  EXPECT_EQ(report["assets"][0]["bodies"], Json({"a", "b"}));
  EXPECT_NE(report["assets"][1]["file"], report["assets"][0]["file"]);
  EXPECT_EQ(plays(report, 0), "mixed");
}

TEST(Scene, KeptPartsAreBakedWhetherAPairNeedsThemOrNot) {
  const TemporaryFolder folder;
  const Json report = plan(folder, kPlane + body("nut", "nut", "mass = \"20g\"\nkeep = [\"voxelmap\"]"));
  EXPECT_EQ(plays(report, 1), "mixed");
}

TEST(Scene, OpenMeshesAreRepairedAsTheirBodySays) {
  const TemporaryFolder folder;
  // A tetrahedron without one of its faces.
  write_file(folder / "open.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  const std::string open = "[[body]]\nname = \"a\"\nmesh = \"open.obj\"\nmass = \"1kg\"\nvoxel = \"2mm\"\n";
  expect_scene_refused(folder, kPlane + open, "scene.toml:7: mesh 'open.obj': ");
  expect_scene_refused(folder, kPlane + open, "repair = \"fill\"");
  const Json as_filled = plan(folder, kPlane + open + "repair = \"fill\"\n", "-o filled");
  const Json as_thick = plan(folder, kPlane + open + "thicken = \"8mm\"\n", "-o thick");
  ASSERT_EQ(as_filled["assets"].size(), 1U);
  Asset filled;
  Asset thick;
  ASSERT_EQ(Asset::open(asset_at(folder, "filled", as_filled, 0).c_str(), filled), Status::ok);
  ASSERT_EQ(Asset::open(asset_at(folder, "thick", as_thick, 0).c_str(), thick), Status::ok);
  EXPECT_NEAR(filled.info().volume, 1e-3 / 6, 1e-9);
  EXPECT_GT(thick.info().bounds_max[0], 0.103);
}

TEST(Scene, AMeshThatCannotBeBakedIsRefusedBeforeAnythingIs) {
  const TemporaryFolder folder;
  write_file(folder / "open.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  const std::string open = "[[body]]\nname = \"open\"\nmesh = \"open.obj\"\n";
  write_file(folder / "scene.toml", kPlane + body("nut", "nut", "mass = \"20g\"") + open + "mass = \"1kg\"\n");
  const std::string why = "scene.toml:11: mesh 'open.obj': the mesh is open";
  // What was baked would be in the cache.
  const std::string others = kPlane + open + "mass = \"1kg\"\n" + body("nut", "nut", "mass = \"20g\"");
  write_file(folder / "first.toml", others);
  expect_refusal(folder, "scene first.toml --cache cache", kBad, "first.toml:7: mesh 'open.obj': the mesh is open");
  expect_refusal(folder, "scene scene.toml --cache cache", kBad, why);
  expect_refusal(folder, "scene scene.toml --dry-run", kBad, why);
  // One that meets nobody is not baked, and may be open.
  (void)plan(folder, kPlane + open + "type = \"static\"\n", "-o out");
}

TEST(Scene, OneMeshOfSeveralNamesIsBakedOnce) {
  const TemporaryFolder folder;
  for (const char* const copy : {"a.obj", "copy.obj"}) std::filesystem::copy_file(sample("nut"), folder / copy);
  std::filesystem::create_symlink("a.obj", folder / "link.obj");
  std::filesystem::create_directory(folder / "sub");
  std::string text = kPlane;
  for (const char* const name : {"a.obj", "./a.obj", "sub/../a.obj", "link.obj", "copy.obj"})
    text += std::string("[[body]]\nname = \"") + name + "\"\nmesh = \"" + name + "\"\nmass = \"20g\"\n";
  const Json report = plan(folder, text);
  EXPECT_EQ(report["assets"].size(), 1U);
  EXPECT_EQ(report["assets"][0]["bodies"].size(), 5U);
  EXPECT_EQ(report["assets"][0]["mesh"], "a.obj");
  // Of another size it is another.
  EXPECT_EQ(plan(folder, text + "scale = 2\n")["assets"].size(), 2U);
}

TEST(Scene, AMassThatIsAbsurdForItsMeshIsDoubted) {
  const TemporaryFolder folder;
  const auto notes = [&](const char* rest) {
    return plan(folder, kPlane + body("nut", "nut", std::string("mass = \"20g\"\n") + rest))["notes"];
  };
  EXPECT_EQ(notes(""), Json::array());
  for (const char* const wrong : {"unit = \"mm\"", "scale = 100"}) {
    const Json said = notes(wrong);
    ASSERT_EQ(said.size(), 1U) << wrong;
    EXPECT_NE(said[0].get<std::string>().find("scene.toml:5: 0.02 kg of 'nut' in "), std::string::npos) << said[0];
  }
}

TEST(Scene, LongNamesOfMeshesAreShortened) {
  const TemporaryFolder folder;
  std::string name;
  for (int i = 0; i < 120; ++i) name += "\xC3\xB6";
  std::filesystem::copy_file(sample("nut"), folder / (name + ".obj"));
  const Json report = plan(
      folder,
      kPlane + std::string("[[body]]\nname = \"a\"\nmass = \"20g\"\nvoxel = \"1mm\"\nmesh = \"") + name + ".obj\"\n",
      "-o out");
  const std::string file = report["assets"][0]["file"];
  EXPECT_EQ(file.substr(0, 101), name.substr(0, 100) + "-");
  EXPECT_TRUE(std::filesystem::exists(folder / ("out/" + file)));
}

TEST(Scene, ScenesInOneFolderDoNotTouchEachOthersAssets) {
  const TemporaryFolder folder;
  const auto nut = [](const char* voxel) {
    return kPlane + body("nut", "nut", std::string("mass = \"20g\"\nvoxel = ") + voxel);
  };
  const Json first = plan(folder, nut("\"1mm\""), "-o out");
  const std::string bytes = read_file(asset_at(folder, "out", first, 0));
  Json other = Json::parse(read_file(folder / "out/scene.vps.json"));
  other["assets"][0]["file"] = "./" + first["assets"][0]["file"].get<std::string>();
  write_file(folder / "out/other.vps.json", other.dump());
  const Json second = plan(folder, nut("\"2mm\""), "-o out");
  EXPECT_NE(first["assets"][0]["file"], second["assets"][0]["file"]);
  (void)plan(folder, nut("\"1mm\""), "-o out");
  (void)plan(folder, nut("\"3mm\""), "-o out");
  EXPECT_TRUE(read_file(asset_at(folder, "out", first, 0)) == bytes);
  // The same name for the same thing, baked or not.
  EXPECT_EQ(plan(folder, nut("\"1mm\""))["assets"][0]["file"], first["assets"][0]["file"]);
}

TEST(Scene, AssetsOfAnEarlierPlanGoWithItsManifest) {
  const TemporaryFolder folder;
  const auto text = [](const char* voxel) {
    return kPlane + body("nut", "nut", std::string("mass = \"20g\"\nvoxel = \"") + voxel + "\"") +
           body("peg", "peg", "mass = \"10g\"\nvoxel = \"1mm\"\nkeep = [\"voxelmap\", \"pointshell\"]");
  };
  const Json first = plan(folder, text("1mm"), "-o out");
  const std::string old = first["assets"][0]["file"];
  EXPECT_EQ(first["removed"], Json::array());
  // What is not the program's stays, whatever the manifest says.
  Json manifest = Json::parse(read_file(folder / "out/scene.vps.json"));
  for (const char* const name : {"notes.txt", "../scene.toml", "none.vps.hdf"}) {
    Json asset = manifest["assets"][0];
    asset["file"] = name;
    manifest["assets"].push_back(asset);
  }
  write_file(folder / "out/notes.txt", "notes");
  write_file(folder / "out/scene.vps.json", "{\n  \"format\": \"vps-scene\"," + manifest.dump().substr(1));
  write_file(folder / "scene.toml", text("0.05mm") + "[wishes]\nmemory = \"1kB\"\n");
  EXPECT_EQ(vpsbake(folder, "scene scene.toml -o out").code, kBad);
  EXPECT_TRUE(std::filesystem::exists(folder / ("out/" + old))) << "a run that fails changes nothing";
  const Json second = plan(folder, text("2mm"), "-o out");
  EXPECT_EQ(second["removed"], Json({old}));
  EXPECT_FALSE(std::filesystem::exists(folder / ("out/" + old)));
  EXPECT_EQ(read_file(folder / "out/notes.txt"), "notes");
  EXPECT_TRUE(std::filesystem::exists(folder / "scene.toml"));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_TRUE(std::filesystem::exists(asset_at(folder, "out", second, i)));
}

TEST(Scene, FilesOfOthersAreNotOverwritten) {
  const TemporaryFolder folder;
  const std::string text = kPlane + body("nut", "nut", "mass = \"20g\"\nvoxel = \"1mm\"");
  const std::string name = plan(folder, text)["assets"][0]["file"];
  std::filesystem::create_directory(folder / "out");
  write_file(folder / ("out/" + name), "notes");
  expect_refusal(folder, "scene scene.toml -o out", 2, name + ": the file exists and is not an asset");
  EXPECT_EQ(read_file(folder / ("out/" + name)), "notes");
  std::filesystem::remove(folder / ("out/" + name));
  write_file(folder / "out/scene.vps.json", "{\"mine\": 1}");
  expect_refusal(folder, "scene scene.toml -o out", 2, "scene.vps.json: the file exists and is not a scene's manifest");
  EXPECT_EQ(read_file(folder / "out/scene.vps.json"), "{\"mine\": 1}");
  std::filesystem::remove(folder / "out/scene.vps.json");
  for (int run = 0; run < 2; ++run) EXPECT_EQ(vpsbake(folder, "scene scene.toml -o out").code, 0);
}

TEST(Scene, BandsAndSegmentsFollowSpeedAndStep) {
  const TemporaryFolder folder;
  const auto bands = [&](const char* speed, const char* restitution, const char* step) {
    const Json report =
        plan(folder, std::string("[wishes]\nstep = \"") + step + "\"\n" +
                         body("bolt", "bolt", std::string("type = \"static\"\nvoxel = \"0.5mm\"\n") + restitution) +
                         body("nut", "nut", std::string("mass = \"20g\"\nvoxel = \"0.5mm\"\n") + speed + restitution));
    return Json({report["assets"][0]["band_inside_vx"], report["assets"][0]["band_outside_vx"],
                 report["bodies"][1]["shapes"][0]["segments"]});
  };
  EXPECT_EQ(bands("", "", "4ms"), Json({2.5, 2.5, 0}));  // nothing is known
  EXPECT_EQ(bands("speed = \"0.1m/s\"\n", "", "4ms"), Json({2.0, 2.0, 0}));
  EXPECT_EQ(bands("speed = \"0.1m/s\"\nvelocity = [\"0m/s\", \"0m/s\", \"-0.5m/s\"]\n", "restitution = 0.5\n", "4ms"),
            Json({4.0, 2.5, 0}));
  EXPECT_EQ(bands("speed = \"3m/s\"\n", "", "4ms"), Json({2.5, 2.5, 0}));  // held by contacts ahead
  EXPECT_EQ(bands("speed = \"0.5m/s\"\n", "restitution = 0.5\n", "4ms"), Json({4.0, 2.5, 0}));
  EXPECT_EQ(bands("speed = \"0.1m/s\"\n", "", "50ms")[2], 15);
}

TEST(Scene, AWishedErrorIsReachedByWhatIsBaked) {
  const TemporaryFolder folder;
  const std::string text = "[wishes]\nerror = \"1mm\"\nmemory = \"5MB\"\n" + std::string(kPlane) +
                           body("hole", "hole", "type = \"static\"") + body("peg", "peg", "mass = \"20g\"");
  const Json report = plan(folder, text, "-o out --compare");
  EXPECT_GT(report["reached_error"], 0.0003);
  EXPECT_LE(report["reached_error"], 0.001);
  double cover = 0;
  double bound = 0;
  std::uintmax_t bytes = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    const std::filesystem::path file = asset_at(folder, "out", report, i);
    bytes += std::filesystem::file_size(file);
    Asset asset;
    ASSERT_EQ(Asset::open(file.c_str(), asset), Status::ok);
    cover = std::max(cover, asset.info().covering_radius);
    bound = std::max(bound, asset.info().scaled_error.bound);
    EXPECT_NE(asset.has_voxelmap(), asset.has_pointshell());
  }
  EXPECT_NEAR(report["reached_error"].get<double>(), cover + bound, 1e-12);
  // What is said to be taken is what the files have.
  EXPECT_EQ(report["planned"]["bytes"], bytes);
  EXPECT_TRUE(report["everything"]["bytes_measured"]);
  EXPECT_TRUE(report["ordinary"]["bytes_measured"]);
  EXPECT_GT(report["ordinary"]["bytes"], bytes);
  EXPECT_GT(report["everything"]["bytes"], report["ordinary"]["bytes"]);
  EXPECT_GT(report["everything"]["bytes"], 2 * bytes);
  EXPECT_GT(report["everything"]["seconds"], 0);
}

TEST(Scene, SavingsAreAgainstAnOrdinaryBakeFirstAndFullOnesSayWhatTheyWrote) {
  const TemporaryFolder folder;
  write_file(folder / "scene.toml", kPlane + body("nut", "nut", "mass = \"20g\"\nvoxel = \"1mm\""));
  const Outcome planned = vpsbake(folder, "scene scene.toml -o out --cache cache");
  EXPECT_LT(planned.out.find("against an ordinary bake, "), planned.out.find("against everything")) << planned.out;
  const Outcome again = vpsbake(folder, "scene scene.toml -o out --cache cache");
  EXPECT_EQ(planned.out.find(" in about "), std::string::npos) << planned.out;
  EXPECT_NE(again.out.find(" in about "), std::string::npos) << again.out;
  const Outcome full = vpsbake(folder, "scene scene.toml -o full --full");
  EXPECT_NE(full.out.find("written "), std::string::npos) << full.out;
}

TEST(Scene, MemoryAndTimeMakeAPlanCoarserBeforeTheyRefuseIt) {
  const TemporaryFolder folder;
  const std::string pair = body("bolt", "bolt", "type = \"static\"") + body("nut", "nut", "mass = \"20g\"");
  const double usual = plan(folder, pair)["assets"][0]["voxel_size"];
  const Json small = plan(folder, "[wishes]\nmemory = \"1MB\"\n" + pair);
  EXPECT_GT(small["assets"][0]["voxel_size"], 2 * usual);
  EXPECT_LE(small["planned"]["bytes"], 1'000'000);
  const Json fast = plan(folder, "[wishes]\ntime_budget = \"20us\"\n" + pair);
  EXPECT_GT(fast["assets"][0]["voxel_size"], usual);
  EXPECT_LE(fast["estimated_step_seconds"], 20e-6);
}

TEST(Scene, AnImpossibleWishIsRefusedWithItsLine) {
  const TemporaryFolder folder;
  const std::string pair = body("bolt", "bolt", "type = \"static\"") + body("nut", "nut", "mass = \"20g\"");
  expect_scene_refused(folder, "[wishes]\n\nmemory = \"1kB\"\n" + pair, "scene.toml:3: the assets would take");
  expect_scene_refused(folder, "[wishes]\nerror = \"0.05mm\"\nmemory = \"2MB\"\n" + pair, "scene.toml:3: the assets");
  expect_scene_refused(folder, "[wishes]\nerror = \"0.01um\"\n" + pair, "scene.toml:2: an error of 0.01 um cannot be");
  expect_scene_refused(folder, "[wishes]\ntime_budget = \"2us\"\n" + pair, "scene.toml:2: contacts would take");
  expect_scene_refused(folder, "[wishes]\nerror = \"0.1mm\"\n" + body("a", "nut", "type = \"static\"\nvoxel = \"1mm\""),
                       "scene.toml:5: voxels of 1 mm are coarser");
}

TEST(Scene, WhatIsWrongIsNamedWithItsLine) {
  const TemporaryFolder folder;
  const std::string nut = body("nut", "nut", "mass = \"20g\"");  // four lines
  expect_scene_refused(folder, "", "scene.toml:1: the scene has no body");
  expect_scene_refused(folder, "[[body]\n", "scene.toml:1: this is not TOML");
  expect_scene_refused(folder, "[wishs]\n" + nut,
                       "scene.toml:1: a scene has no key 'wishs' here; did you mean 'wishes'");
  expect_scene_refused(folder, nut + "spede = \"1m/s\"\n", "scene.toml:5: [[body]] has no key 'spede' here; did you");
  expect_scene_refused(folder, body("a", "nut", "mas = \"1g\""),
                       "scene.toml:4: [[body]] has no key 'mas' here; did you mean 'mass'?");
  expect_scene_refused(folder, "[[body]]\nName = \"b\"\n",
                       "scene.toml:2: [[body]] has no key 'Name' here; did you mean 'name'?");
  expect_scene_refused(folder, nut + nut, "scene.toml:5: two bodies are named 'nut', the other on line 1");
  expect_scene_refused(folder, "[[body]]\nname = \"a\"\n\nmesh = \"none.obj\"\nmass = \"1kg\"\n",
                       "scene.toml:4: mesh 'none.obj': the file does not exist", kMissing);
  expect_scene_refused(folder, body("a", "nut", "type = \"dynamic\""), "scene.toml:1: body 'a' is dynamic and needs");
  expect_scene_refused(folder, body("a", "nut", ""), "scene.toml:1: body 'a' needs type");
  expect_scene_refused(folder, body("a", "nut", "mass = \"0kg\""), "scene.toml:4: mass: 0kg is not a positive mass");
  expect_scene_refused(folder, body("a", "nut", "mass = 1"), "scene.toml:4: mass is a text, in quotes, with a unit");
  expect_scene_refused(folder, body("a", "nut", "mass = \"1\""), "scene.toml:4: mass: a mass needs a unit");
  expect_scene_refused(folder, nut + "position = [\"1m\", \"0m\"]\n", "scene.toml:5: position is a list of three");
  expect_scene_refused(folder, nut + "position = [\"1m\", \"0m\", \"1e30m\"]\n", "scene.toml:1: a number of 'nut'");
  expect_scene_refused(folder, nut + "scale = 1e-9\n", "is smaller than a thousandth of a millimetre");
  expect_scene_refused(folder, body("a\\u0007b", "nut", "mass = \"1kg\""), "has control characters in it");
  expect_scene_refused(folder, nut + "mask = 1.5\n", "scene.toml:5: mask is a whole number");
  expect_scene_refused(folder, nut + "shape = \"box\"\n", "scene.toml:1: a body has one of mesh");
  expect_scene_refused(folder, "[[body]]\nname = \"b\"\nshape = \"ball\"\n", "scene.toml:3: shape is one of \"box\"");
  expect_scene_refused(folder, "[[body]]\nname = \"b\"\nshape = \"sphere\"\n", "scene.toml:1: this shape needs radius");
  expect_scene_refused(folder, "[[body]]\nname = \"b\"\nshape = \"plane\"\nmass = \"1kg\"\n",
                       "scene.toml:1: a plane cannot move");
  expect_scene_refused(folder, "[[body]]\nname = \"a\"\nurdf = \"none.urdf\"\n", "scene.toml:3: 'none.urdf' does not",
                       kMissing);
  expect_scene_refused(folder, "[[body]]\nname = \"a\"\nmesh = \"n\\u0000.obj\"\nmass = \"1kg\"\n",
                       "scene.toml:3: mesh is not the name of a file");
  expect_scene_refused(folder, body(std::string(1025, 'a'), "nut", "mass = \"1kg\""), "longer than 1024 bytes");
  const std::string ball = "[[body]]\nname = \"b\"\nshape = \"sphere\"\nradius = \"1cm\"\nmass = \"1kg\"\n";
  for (const char* const mesh_only : {"voxel = \"1mm\"", "keep = [\"voxelmap\"]", "segments = 3", "scale = 2"})
    expect_scene_refused(folder, ball + mesh_only, "means nothing beside the other keys of this [[body]]");
  expect_scene_refused(folder, nut + "radius = \"1mm\"\n", "scene.toml:5: 'radius' means nothing beside");
  expect_scene_refused(
      folder, "[[body]]\nname = \"b\"\nshape = \"box\"\nsize = [\"0.001um\", \"1m\", \"1m\"]\nmass = \"1kg\"\n",
      "scene.toml:1: a size of this shape is below 2 nm");
  expect_refusal(folder, "scene none.toml", kMissing, "none.toml: the scene does not exist");
  expect_refusal(folder, "scene " + sample("nut"), kBad, "a scene is a .toml or a .urdf file");
  write_file(folder / "scene.toml", nut);
  write_file(folder / "scene.vps", "");
  expect_refusal(folder, "scene scene.toml", 2, "scene.vps: this is a file");
  expect_refusal(folder, "scene scene.toml -o none/out", 2, "the folder above does not exist");
}

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

TEST(Scene, LinksThatFixedJointsHoldAreOneBodyAndJoinedBodiesDoNotMeet) {
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
  // 3 kg at 0.1 m and 1 kg at -0.1 m: 50 mm up, 2 * 2 * 0.03 more of inertia across.
  EXPECT_NEAR(ram["centre_of_mass"][2].get<double>(), 0.05, 1e-12);
  EXPECT_NEAR(ram["inertia"][0].get<double>(), 0.3 + 3 * 0.05 * 0.05 + 0.15 * 0.15, 1e-12);
  EXPECT_NEAR(ram["inertia"][2].get<double>(), 0.5, 1e-12);
  EXPECT_EQ(ram["position"][2], 1.0);
  ASSERT_EQ(ram["shapes"].size(), 2U);
  EXPECT_EQ(ram["shapes"][0]["half_extents"], Json({0.05, 0.1, 0.15}));
  EXPECT_EQ(ram["shapes"][1]["part"], "pointshell");
  EXPECT_NEAR(ram["shapes"][1]["position"][2].get<double>(), -0.1, 1e-12);
  EXPECT_NEAR(ram["shapes"][1]["orientation"][2].get<double>(), std::sqrt(0.5), 1e-12);
  Asset peg;
  ASSERT_EQ(Asset::open(asset_at(folder, "out", report, 1).c_str(), peg), Status::ok);
  EXPECT_NEAR(peg.info().bounds_max[0], 2 * 0.0039, 1e-6);
}

TEST(Scene, AUrdfThatCannotBeUsedIsRefusedWithItsLine) {
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
  expect_urdf_refused(robot("<mesh filename=\"package://none/none.obj\"/>"), "r.urdf:13: mesh 'none/none.obj'",
                      kMissing);
  expect_urdf_refused(robot("<mesh filename=\"a.obj\" scale=\"1 2 1\"/>"),
                      "r.urdf:13: this mesh is scaled differently");
  std::string light = robot("<sphere radius=\"1\"/>");
  light.replace(light.find("<mass value=\"3\""), 15, "<mass value=\"-1\"");
  expect_urdf_refused(light, "r.urdf:5: link 'ram' has a negative mass or moment of inertia");
  std::string spun = robot("<sphere radius=\"1\"/>");
  spun.replace(spun.find("iyy=\"0.3\""), 9, "iyy=\"-9\"");
  expect_urdf_refused(spun, "r.urdf:5: link 'ram' has a negative mass or moment of inertia");
  expect_urdf_refused(robot("<sphere radius=\"-1\"/>"), "r.urdf:13: a size of this shape is below 2 nm");
  // What urdfdom says without a line.
  expect_urdf_refused(robot("<sphere radius=\"wide\"/>"), "r.urdf:10: this is not a URDF that can be used: ");
  expect_urdf_refused(robot("<capsule radius=\"1\" length=\"1\"/>"),
                      "r.urdf:10: this is not a URDF that can be used: ");
  const auto with = [&](const std::string& old, const std::string& text) {
    std::string whole = robot("<sphere radius=\"1\"/>");
    return whole.replace(whole.find(old), old.size(), text);
  };
  expect_urdf_refused(with("<child link=\"block\"/>", "<child link=\"blok\"/>"), "r.urdf:20: this is not a URDF");
  expect_urdf_refused(with("<link name=\"finger\">", "<link name=\"ram\">"), "r.urdf:5: this is not a URDF");
  // What urdfdom passes over.
  expect_urdf_refused(with("<collision><geometry><box size=\"0.1 0.2 0.3\"/></geometry></collision>", "<colision/>"),
                      "r.urdf:8: <link> has no <colision>; did you mean <collision>?");
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

TEST(Scene, WhatAUrdfHasBesidesIsSaidOnce) {
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

TEST(Scene, AUrdfWhoseJointsGoRoundInACircleIsRefused) {
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

TEST(Scene, AChainOfTooManyLinksIsRefused) {
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

TEST(Scene, ATomlTakesBodiesFromAUrdf) {
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

TEST(Scene, RealUrdfsAreRead) {
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

TEST(Scene, ExamplesOutputsAndManifestsHoldToTheirSchemas) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const TemporaryFolder folder;
  const std::string docs = VPS_DOCS;
  const auto check = [&](const std::string& file, const char* schema) {
    EXPECT_TRUE(follows_schema(folder / file, schema)) << read_file(folder / file);
  };
  for (const char* const example : {"nut_on_bolt.toml", "press.urdf"}) {
    const std::string name = std::filesystem::path(example).stem();
    for (const char* const options : {" --dry-run", " -o out"}) {
      const Outcome run = vpsbake(folder, "scene " + docs + "/examples/" + example + options + " --json");
      ASSERT_EQ(run.code, 0) << run.err;
      EXPECT_GT(Json::parse(run.out)["pairs_that_meet"], 0) << example;
      write_file(folder / "report.json", run.out);
      check("report.json", "scene_report.schema.json");
    }
    check("out/" + name + ".vps.json", "scene_manifest.schema.json");
  }
}

}  // namespace
}  // namespace vps::test

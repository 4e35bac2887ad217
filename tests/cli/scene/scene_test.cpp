// SPDX-License-Identifier: GPL-3.0-or-later
// Planning of scenes as a user sees it: which bodies collide, which part each plays, and which scenes are refused
// before baking.
#include <fmt/format.h>

#include <regex>

#include "runtime/vps_runtime.h"
#include "tests/cli/scene/scene_plan.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

std::string plays(const Json& report, std::size_t number) {
  return report["bodies"][number]["shapes"][0]["plays"];
}

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
  // Static and kinematic bodies do not collide with each other.
  EXPECT_EQ(report["pairs"], 10);
  EXPECT_EQ(report["pairs_that_meet"], 4);
  EXPECT_EQ(report["bodies"][2]["meets"], Json({"ground", "bolt", "post", "lift"}));
  // The nut has the finest voxels, or fewer points where the others' are about as fine.
  EXPECT_EQ(plays(report, 1), "voxelmap");
  EXPECT_EQ(plays(report, 2), "pointshell");
  EXPECT_EQ(plays(report, 3), "voxelmap");
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

TEST(Scene, WhatIsKeptWithoutPartnersIsSaidToBeBaked) {
  const TemporaryFolder folder;
  write_file(folder / "scene.toml", body("nut", "nut", "type = \"static\"\nvoxel = \"2mm\"\nkeep = [\"voxelmap\"]"));
  const Outcome kept = vpsbake(folder, "scene scene.toml -o out");
  EXPECT_EQ(kept.out.find("nothing is baked"), std::string::npos) << kept.out;
  EXPECT_NE(kept.out.find("note: no body has a mass"), std::string::npos) << kept.out;
  EXPECT_NE(kept.out.find("\n    left out: pointshell, layers and real"), std::string::npos) << kept.out;
  const Outcome full = vpsbake(folder, "scene scene.toml -o full --full");
  EXPECT_EQ(full.out.find("\n    left out"), std::string::npos) << full.out;
}

TEST(Scene, OpenMeshesAreRepairedAsTheirBodySays) {
  const TemporaryFolder folder;
  // A tetrahedron without one of its faces.
  write_file(folder / "open.obj", "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n");
  const std::string open = "[[body]]\nname = \"a\"\nmesh = \"open.obj\"\nmass = \"1kg\"\nvoxel = \"2mm\"\n";
  expect_scene_refused(folder, kPlane + open, "scene.toml:7: mesh 'open.obj': ");
  expect_scene_refused(folder, kPlane + open, "repair = \"fill\"");
  expect_scene_refused(folder, kPlane + open, "or thicken = \"4mm\" for a sheet");
  write_file(folder / "open.urdf",
             "<robot name=\"r\"><link name=\"l\"><collision><geometry><mesh filename=\"open.obj\"/></geometry>"
             "</collision></link></robot>");
  expect_scene_refused(folder, kPlane + std::string("[[body]]\nname = \"a\"\nurdf = \"open.urdf\"\nmass = \"1kg\"\n"),
                       "for a sheet, in a TOML that names the URDF");
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
  // Anything baked before the refusal would be in the cache.
  const std::string others = kPlane + open + "mass = \"1kg\"\n" + body("nut", "nut", "mass = \"20g\"");
  write_file(folder / "first.toml", others);
  expect_refusal(folder, "scene first.toml --cache cache", kBad, "first.toml:7: mesh 'open.obj': the mesh is open");
  expect_refusal(folder, "scene scene.toml --cache cache", kBad, why);
  expect_refusal(folder, "scene scene.toml --dry-run", kBad, why);
  // A body that collides with none is not baked and may be open.
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
  // With another scale it is another asset.
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
  // The same asset gets the same name, baked or not.
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
  // Files that are no assets of the program stay, even if the manifest lists them.
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
  EXPECT_EQ(bands("", "", "4ms"), Json({2.5, 2.5, 0}));  // no speed is given
  EXPECT_EQ(bands("speed = \"0.1m/s\"\n", "", "4ms"), Json({2.0, 2.0, 0}));
  EXPECT_EQ(bands("speed = \"0.1m/s\"\nvelocity = [\"0m/s\", \"0m/s\", \"-0.5m/s\"]\n", "restitution = 0.5\n", "4ms"),
            Json({4.0, 2.5, 0}));
  EXPECT_EQ(bands("speed = \"3m/s\"\n", "", "4ms"), Json({2.5, 2.5, 0}));  // stopped by speculative contacts
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
    EXPECT_TRUE(asset.has_voxelmap());  // a pointshell's distances place its contacts
  }
  EXPECT_NEAR(report["reached_error"].get<double>(), cover + bound, 1e-12);
  // The reported sizes are those of the files.
  EXPECT_EQ(report["planned"]["bytes"], bytes);
  EXPECT_TRUE(report["everything"]["bytes_measured"]);
  EXPECT_TRUE(report["ordinary"]["bytes_measured"]);
  EXPECT_GE(report["ordinary"]["bytes"], bytes);
  EXPECT_GT(report["everything"]["bytes"], report["ordinary"]["bytes"]);
  EXPECT_GT(report["everything"]["bytes"], 2 * bytes);
  EXPECT_GT(report["everything"]["seconds"], 0);
}

// The ring needs no points: the ball has fewer.
TEST(Scene, TheSavingOfAPointshellIsEstimated) {
  const TemporaryFolder folder;
  const std::string text = body("ring", "torus", "type = \"static\"\nvoxel = \"2mm\"") +
                           body("ball", "icosphere", "mass = \"20g\"\nvoxel = \"2mm\"");
  const auto saved = [&](const char* arguments, int asset) {
    const Json costs = plan(folder, text, arguments)["assets"][asset];
    return costs["ordinary"]["bytes"].get<double>() - costs["planned"]["bytes"].get<double>();
  };
  const double measured = saved("-o out --compare", 0);
  EXPECT_GT(measured, 20e3);
  EXPECT_NEAR(saved("-o out", 0), measured, 0.4 * measured);
  EXPECT_EQ(saved("-o out", 1), 0);
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
  // Where only the plan's own bakes are new, nothing saved is negative.
  ASSERT_EQ(vpsbake(folder, "scene scene.toml -o compared --cache cache --compare").code, 0);
  for (const std::filesystem::path& entry : files_of_entries(folder / "cache")) {
    for (const auto& asset : std::filesystem::directory_iterator(folder / "out"))
      if (std::filesystem::exists(entry) && read_file(entry) == read_file(asset.path())) std::filesystem::remove(entry);
  }
  const Outcome compared = vpsbake(folder, "scene scene.toml -o new --cache cache --compare");
  EXPECT_NE(compared.out.find(" against everything"), std::string::npos) << compared.err;
  EXPECT_EQ(compared.out.find(" -"), std::string::npos) << compared.out;
}

TEST(Scene, WhatMeetsNobodyIsComparedToo) {
  const TemporaryFolder folder;
  const Json report = plan(folder,
                           kPlane + body("nut", "nut", "mass = \"20g\"\nvoxel = \"1mm\"") +
                               body("cube", "cube", "type = \"static\"\nmask = 0\nvoxel = \"5mm\""),
                           "-o out --compare");
  const Json& cube = report["assets"][1];
  EXPECT_TRUE(cube["file"].is_null());
  EXPECT_EQ(cube["planned"]["bytes"], 0);
  EXPECT_GT(cube["ordinary"]["bytes"], 0);
  EXPECT_TRUE(cube["everything"]["bytes_measured"]);
}

TEST(Scene, MemoryAndTimeMakeAPlanCoarserBeforeTheyRefuseIt) {
  const TemporaryFolder folder;
  const std::string pair = body("bolt", "bolt", "type = \"static\"") + body("nut", "nut", "mass = \"20g\"");
  const double usual = plan(folder, pair)["assets"][0]["voxel_size"];
  const Json small = plan(folder, "[wishes]\nmemory = \"2MB\"\n" + pair);
  EXPECT_GT(small["assets"][0]["voxel_size"], 2 * usual);
  EXPECT_LE(small["planned"]["bytes"], 2'000'000);
  const Json fast = plan(folder, "[wishes]\ntime_budget = \"20us\"\n" + pair);
  EXPECT_GT(fast["assets"][0]["voxel_size"], usual);
  EXPECT_LE(fast["estimated_step_seconds"], 20e-6);
}

TEST(Scene, AnImpossibleWishIsRefusedWithItsLine) {
  const TemporaryFolder folder;
  const std::string pair = body("bolt", "bolt", "type = \"static\"") + body("nut", "nut", "mass = \"20g\"");
  expect_scene_refused(folder, "[wishes]\n\nmemory = \"1kB\"\n" + pair, "scene.toml:3: the assets would take");
  for (const auto& [memory, text] :
       {std::pair("20B", "more than the 20 B wished"), std::pair("999.96kB", "more than the 1 MB wished")})
    expect_scene_refused(folder, std::string("[wishes]\nmemory = \"") + memory + "\"\n" + pair, text);
  expect_scene_refused(folder, "[wishes]\nerror = \"0.05mm\"\nmemory = \"2MB\"\n" + pair, "scene.toml:3: the assets");
  expect_scene_refused(folder, "[wishes]\nerror = \"0.01um\"\n" + pair, "scene.toml:2: an error of 0.01 um cannot be");
  expect_scene_refused(folder, "[wishes]\nerror = \"10um\"\n" + pair, "choose larger voxels\n");
  expect_scene_refused(folder, "[wishes]\ntime_budget = \"2us\"\n" + pair, "scene.toml:2: contacts would take");
  // The two numbers differ, however near they are.
  const std::string stated = body("bolt", "bolt", "type = \"static\"\nvoxel = \"1mm\"") +
                             body("nut", "nut", "mass = \"20g\"\nvoxel = \"1mm\"");
  const double seconds = plan(folder, stated)["estimated_step_seconds"];
  write_file(folder / "scene.toml",
             fmt::format("[wishes]\ntime_budget = \"{:.9g}us\"\n", 0.99999e6 * seconds) + stated);
  const std::string why = vpsbake(folder, "scene scene.toml --dry-run").err;
  const std::regex numbers("would take ([0-9.]+) us .* more than the ([0-9.]+) us wished");
  std::smatch both;
  ASSERT_TRUE(std::regex_search(why, both, numbers)) << why;
  EXPECT_NE(both[1], both[2]) << why;
  const std::size_t bytes = plan(folder, stated)["planned"]["bytes"];
  write_file(folder / "scene.toml", fmt::format("[wishes]\nmemory = \"{}B\"\n", bytes - 1) + stated);
  const std::string memory = vpsbake(folder, "scene scene.toml --dry-run").err;
  const std::regex sizes("would take ([0-9.]+) ([kM]?B) of memory .* more than the ([0-9.]+) ([kM]?B) wished");
  ASSERT_TRUE(std::regex_search(memory, both, sizes)) << memory;
  EXPECT_NE(both[1], both[3]) << memory;
  EXPECT_EQ(both[2], both[4]) << memory;
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
  expect_scene_refused(folder, body("a", "nut", "mass = \"14001t\""),
                       "scene.toml:1: 'a' has 1.4001e+07 kg: Bullet's solver takes bodies of more than 1.4e+07 kg");
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
  expect_scene_refused(folder, body("a", "nut", "type = \"static\"") + "speed = \"1m/s\"\n",
                       "scene.toml:5: 'speed' means nothing beside");
  expect_scene_refused(
      folder, "[[body]]\nname = \"b\"\nshape = \"box\"\nsize = [\"0.001um\", \"1m\", \"1m\"]\nmass = \"1kg\"\n",
      "scene.toml:1: a size of this shape is below 2 nm");
  expect_refusal(folder, "scene none.toml", kMissing, "none.toml: the scene does not exist");
  expect_refusal(folder, "scene " + sample("nut"), kBad, "a scene is a .toml or a .urdf file");
  write_file(folder / "scene.toml", nut);
  write_file(folder / "scene.vps", "");
  expect_refusal(folder, "scene scene.toml", 2, "scene.vps: this is a file");
  expect_refusal(folder, "scene scene.toml -o none/out", 2, "the folder above does not exist");
  write_file(folder / "scene.toml", "[[body]]\nname = \"a\"\nmesh = \"none.obj\"\nmass = \"1kg\"\n");
  expect_refusal(folder, "scene scene.toml -o none/out", 2, "none/out: the folder above does not exist");
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

// SPDX-License-Identifier: GPL-3.0-or-later
// Runs `vpsbake stress` as a user does.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/cli/program.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

void bake_gear(const TemporaryFolder& folder, const std::string& options = "", const char* name = "gear.vps.hdf") {
  ASSERT_EQ(vpsbake(folder, sample("gear") + " --voxel 1mm -o " + name + " " + options).code, 0);
}

// Runs a Python program in the folder. @return its output and its exit code
std::string python(const TemporaryFolder& folder, const std::string& program) {
  const std::string file = folder / "check.py";
  write_file(file, program);
  const std::string command =
      "cd " + folder.path().string() + " && /usr/bin/python3 -B check.py >check.txt 2>&1; echo $? >>check.txt";
  EXPECT_EQ(std::system(command.c_str()), 0);
  return read_file(folder / "check.txt");
}

TEST(StressCommand, ACaseThatIsHeldEndsWith0AndALineAndACertificate) {
  const TemporaryFolder folder;
  bake_gear(folder);
  const Outcome run = vpsbake(folder, "stress gear.vps.hdf --quick --cases 'penalty_bound_plane,tip' --mass 500g");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  EXPECT_NE(run.out.find("held     penalty_bound_plane"), std::string::npos) << run.out;
  EXPECT_EQ(run.out.rfind("peers: gimpact of the asset's zero set, ", 0), 0U) << run.out;
  EXPECT_NE(run.out.find("hacd held"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("\ncertificate: gear.vps.hdf: 0.5 kg in a penalty loop is stable to "), std::string::npos)
      << run.out;
}

TEST(StressCommand, ABodyThrownThroughAWallEndsWith5WhereThatCounts) {
  const TemporaryFolder folder;
  bake_gear(folder);
  const std::string command = "stress gear.vps.hdf --quick --cases impact_bouncing --without hull,hacd,gimpact";
  EXPECT_EQ(vpsbake(folder, command).code, 0);
  const Outcome strict = vpsbake(folder, command + " --strict --junit j.xml");
  EXPECT_EQ(strict.code, 5);
  EXPECT_NE(strict.out.find("ours (not promised) broken"), std::string::npos) << strict.out;
  EXPECT_NE(strict.out.find("continuous held"), std::string::npos) << strict.out;
  EXPECT_EQ(strict.out.rfind("broken   impact_bouncing", 0), 0U) << strict.out;
  EXPECT_NE(strict.out.find("1 of 1 cases broken"), std::string::npos) << strict.out;
  EXPECT_NE(read_file(folder / "j.xml").find("failures=\"1\""), std::string::npos);
}

TEST(StressCommand, AMeshThatCannotBeMadeOfAThinPlateIsSkippedWithItsReason) {
  const TemporaryFolder folder;
  for (const std::string parts : {"", " --parts pointshell"}) {
    ASSERT_EQ(vpsbake(folder, sample("thin_plate") + " --voxel 2mm -o plate.vps.hdf" + parts).code, 0);
    const Outcome run = vpsbake(folder, "stress plate.vps.hdf --cases 'size_*' --without hull,hacd,gimpact");
    const char* const reason = parts.empty() ? "this one's walls are too thin for its voxels" : "this one no voxelmap";
    EXPECT_NE(run.out.find(std::string("ours skipped (an asset holds no mesh, and ") + reason), std::string::npos)
        << run.out;
  }
}

TEST(StressCommand, TheSameRunTwiceGivesTheSameNumbers) {
  const TemporaryFolder folder;
  bake_gear(folder);
  const auto numbers = [&](const char* name) {
    EXPECT_LE(vpsbake(folder, std::string("stress gear.vps.hdf --quick --cases '*bound_plane,rest_depth,wedge,deep*' "
                                          "--without hacd,gimpact -o ") +
                                  name)
                  .code,
              5);
    return nlohmann::json::parse(read_file(folder / (std::string(name) + ".json")))["assets"];
  };
  const nlohmann::json first = numbers("a");
  EXPECT_EQ(first[0]["cases"].size(), 4U);
  EXPECT_EQ(first, numbers("b"));
}

TEST(StressCommand, TheJsonIsAsItsSchemaSays) {
  const TemporaryFolder folder;
  bake_gear(folder);
  bake_gear(folder, "--parts voxelmap", "map.vps.hdf");
  const Outcome run = vpsbake(folder,
                              "stress gear.vps.hdf map.vps.hdf --quick --cases "
                              "'penalty_bound_plane,penalty_sweep,tip,impact_b*,size_world' -o s --seed 7");
  EXPECT_LE(run.code, 5) << run.err;
  const auto json = nlohmann::json::parse(read_file(folder / "s.json"));
  EXPECT_EQ(json["seed"], 7);
  EXPECT_NE(json["command"].get<std::string>().find("--seed 7"), std::string::npos);
  EXPECT_EQ(json["assets"].size(), 2U);
  for (const auto& one : json["assets"][1]["cases"]) {
    EXPECT_EQ(one["verdict"], "skipped");
    EXPECT_EQ(one["columns"][0]["trials"][0]["remark"], "the asset has no pointshell");
  }
  VPS_SCHEMA_CHECK_OR_SKIP();
  EXPECT_TRUE(follows_schema(folder / "s.json", "stress.schema.json"));
}

TEST(StressCommand, JUnitIsWellFormedAndHasAFailureForEachBrokenCase) {
  const TemporaryFolder folder;
  bake_gear(folder, "--parts pointshell");  // no other size of it can be baked
  std::filesystem::copy_file(folder / "gear.vps.hdf", folder / "a<&\">.vps.hdf");
  const Outcome run = vpsbake(folder,
                              "stress 'a<&\">.vps.hdf' --quick --cases 'impact_bouncing,tip,size_queries' "
                              "--without hull,hacd,gimpact --strict --junit j.xml");
  EXPECT_EQ(run.code, 5) << run.out << run.err;
  const std::string said = python(folder,
                                  "import xml.etree.ElementTree as t\n"
                                  "suite = t.parse('j.xml').getroot()[0]\n"
                                  "assert suite.get('name') == 'a<&\">.vps.hdf', suite.attrib\n"
                                  "assert (suite.get('tests'), suite.get('failures'), suite.get('skipped')) "
                                  "== ('3', '1', '1'), suite.attrib\n"
                                  "assert len(suite.findall('testcase/failure')) == 1\n"
                                  "assert 'ours at speed 10 m/s, wall 4 vx: ' in suite.find('testcase/failure').text\n"
                                  "assert len(suite.findall('testcase/skipped')) == 1\n");
  EXPECT_EQ(said, "0\n") << read_file(folder / "j.xml");
}

TEST(StressCommand, AnAssetWithoutVoxelmapSkipsWhatNeedsOne) {
  const TemporaryFolder folder;
  bake_gear(folder, "--parts pointshell", "shell.vps.hdf");
  const Outcome run =
      vpsbake(folder, "stress shell.vps.hdf --quick --cases 'coincident,stack,tip' --without hacd,gimpact");
  EXPECT_EQ(run.code, 0) << run.err;
  for (const char* const name : {"coincident", "stack"})
    EXPECT_NE(run.out.find(std::string("skipped  ") + name), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("the asset has no voxelmap"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("held     tip"), std::string::npos) << run.out;
}

TEST(StressCommand, WhereEveryCaseWasSkippedTheRunFailsAndSaysSo) {
  const TemporaryFolder folder;
  bake_gear(folder, "--parts voxelmap", "map.vps.hdf");
  const Outcome run = vpsbake(folder, "stress map.vps.hdf --quick --cases 'rest_*,tip'");
  EXPECT_EQ(run.code, 5);
  EXPECT_EQ(run.err, "vpsbake: error: map.vps.hdf: every case was skipped: nothing was tested\n");
}

TEST(StressCommand, PeersOfAnAssetWithoutMeshAndVoxelmapAreSkippedAndSaid) {
  const TemporaryFolder folder;
  bake_gear(folder, "--parts pointshell", "shell.vps.hdf");
  const Outcome run = vpsbake(folder, "stress shell.vps.hdf --quick --cases slide --without ours,continuous");
  EXPECT_EQ(run.out.rfind("peers: hull of the pointshell\n", 0), 0U) << run.out;
  for (const std::string peer : {"hacd", "gimpact"})
    EXPECT_NE(run.out.find(peer + " skipped (an asset holds no mesh, and this one no voxelmap"), std::string::npos)
        << run.out;
}

TEST(StressCommand, PeersArePlayedAtEverySize) {
  const TemporaryFolder folder;
  bake_gear(folder);
  const Outcome run = vpsbake(folder, "stress gear.vps.hdf --quick --cases size_world --without ours,continuous -o s");
  EXPECT_EQ(run.code, 0) << run.err;
  const auto json = nlohmann::json::parse(read_file(folder / "s.json"));
  const auto& columns = json["assets"][0]["cases"][0]["columns"];
  ASSERT_EQ(columns.size(), 3U);
  for (const auto& column : columns) {
    EXPECT_EQ(column["trials"].size(), 2U);
    for (const auto& trial : column["trials"]) EXPECT_NE(trial["verdict"], "skipped") << column["column"];
    EXPECT_TRUE(json["assets"][0]["peers"].contains(column["column"])) << column["column"];
  }
}

// The mesh has the bounds of the baked cube but a sixth of its volume.
TEST(StressCommand, AMeshThatEnclosesAnotherVolumeIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o cube.vps.hdf").code, 0);
  write_file(folder / "octahedron.obj",
             "v 0.05 0 0\nv 0 0.05 0\nv 0 0 0.05\nv -0.05 0 0\nv 0 -0.05 0\nv 0 0 -0.05\n"
             "f 1 2 3\nf 2 4 3\nf 4 5 3\nf 5 1 3\nf 2 1 6\nf 4 2 6\nf 5 4 6\nf 1 5 6\n");
  const std::string command = "stress cube.vps.hdf --quick --cases slide --without hacd --mesh ";
  expect_refusal(folder, command + "octahedron.obj --unit m", 3,
                 "octahedron.obj: the mesh encloses 0.000167 m^3, the asset 0.001 m^3");
  EXPECT_EQ(vpsbake(folder, command + sample("cube") + " --unit m").code, 0);
}

TEST(StressCommand, ListNamesEveryCaseAndItsLimit) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(folder, "stress --list --cases 'impact_*'");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_NE(run.out.find("impact_baked"), std::string::npos);
  EXPECT_NE(run.out.find("limit 1 vx"), std::string::npos);
  EXPECT_EQ(run.out.find("rest_depth"), std::string::npos);
}

TEST(StressCommand, PagesOfOtherCommandsAreNotReplacedNorReplaceIt) {
  const TemporaryFolder folder;
  bake_gear(folder);
  const std::string stress = "stress gear.vps.hdf --quick --cases tip -o ";
  ASSERT_EQ(vpsbake(folder, "view gear.vps.hdf").code, 0);
  expect_refusal(folder, stress + "gear", 2, "gear.html: the file exists and is not a page of stress");
  EXPECT_EQ(vpsbake(folder, "view gear.vps.hdf").code, 0) << "its own page is replaced";
  std::filesystem::remove(folder / "gear.html");
  ASSERT_EQ(vpsbake(folder, "export gear.vps.hdf --to json").code, 0);
  expect_refusal(folder, stress + "gear", 2, "gear.json: the file exists and is not JSON of stress");
  for (int again = 0; again < 2; ++again) EXPECT_EQ(vpsbake(folder, stress + "s").code, 0);
  expect_refusal(folder, "view gear.vps.hdf -o s.html", 2, "s.html: the file exists and is not a page of view");
}

TEST(StressCommand, BadInputIsOneLine) {
  const TemporaryFolder folder;
  bake_gear(folder);
  write_file(folder / "text.vps.hdf", "no asset");
  expect_refusal(folder, "stress", 1, "an asset is required");
  expect_refusal(folder, "stress gear.vps.hdf --cases nothing", 1, "no case is named like 'nothing'");
  expect_refusal(folder, "stress gear.vps.hdf --solver gauss", 1, "gauss");
  expect_refusal(folder, "stress gear.vps.hdf --cases 'tip,rset_*'", 1, "no case is named like 'rset_*'");
  expect_refusal(folder, "stress gear.vps.hdf --mass 3", 1, "a mass needs a unit; write 3g or 3kg");
  expect_refusal(folder, "stress gear.vps.hdf --mass 1.5e7kg", 1, "--mass takes 1e-9kg to 1.4e7kg");
  expect_refusal(folder, "stress gear.vps.hdf -o ./", 1, "'./' is a folder");
  expect_refusal(folder, "stress gear.vps.hdf -o s --junit ./s.html", 1, "'./s.html' is written twice");
  expect_refusal(folder, "stress gear.vps.hdf --mass=-3kg", 1, "-3kg is not a positive mass");
  expect_refusal(folder, "stress gear.vps.hdf --without us", 1, "us");
  expect_refusal(folder, "stress gear.vps.hdf gear.vps.hdf --mesh gear.obj", 1, "--mesh is that of one asset");
  expect_refusal(folder, "stress nowhere.vps.hdf", 2, "nowhere.vps.hdf");
  expect_refusal(folder, "stress text.vps.hdf", 3, "text.vps.hdf");
  expect_refusal(folder, "stress gear.vps.hdf -o nowhere/a", 2, "the folder does not exist");
  expect_refusal(folder, "stress nowhere.vps.hdf --cache text.vps.hdf/a", 2, "choose another folder for --cache");
  expect_refusal(folder, "stress gear.vps.hdf --mesh " + sample("gear") + " --unit cm", 3, " um against 43.7 mm");
  expect_refusal(folder, "stress gear.vps.hdf --mesh nowhere.obj", 2, "nowhere.obj: the file does not exist");
}

}  // namespace
}  // namespace vps::test

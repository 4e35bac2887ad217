// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake compare` on equal and different assets of shapes whose difference is known.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <sstream>

#include "tests/cli/program.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

// A cube of 2 cm with its minimum corner at x on the x axis. [m]
std::string box_at(double x) {
  std::string text;
  for (int corner = 0; corner < 8; ++corner) {
    text += "v " + std::to_string(x + 0.02 * (corner & 1)) + " " + std::to_string(0.02 * (corner >> 1 & 1)) + " " +
            std::to_string(0.02 * (corner >> 2)) + "\n";
  }
  return text +
         "f 1 3 4\nf 1 4 2\nf 5 6 8\nf 5 8 7\nf 1 2 6\nf 1 6 5\nf 3 7 8\nf 3 8 4\nf 1 5 7\nf 1 7 3\nf 2 4 8\nf 2 8 6\n";
}

Json compared(const TemporaryFolder& folder, const std::string& files, int code) {
  const Outcome run = vpsbake(folder, "compare " + files + " --json");
  EXPECT_EQ(run.code, code) << run.err;
  return Json::parse(run.out);
}

TEST(Compare, AnAssetIsTheSameAsItself) {
  const TemporaryFolder folder;
  for (const char* const name : {"a", "b"})
    ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o " + name + ".vps.hdf").code, 0);
  EXPECT_EQ(compared(folder, "a.vps.hdf b.vps.hdf", 0)["same"], "bytes");
  EXPECT_NE(vpsbake(folder, "compare a.vps.hdf b.vps.hdf").out.find("the same bytes\n"), std::string::npos);
}

TEST(Compare, AnotherRecordIsStillTheSameContent) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm --repair fill -o b.vps.hdf").code, 0);
  const Json j = compared(folder, "a.vps.hdf b.vps.hdf", 0);
  EXPECT_EQ(j["same"], "content");
  ASSERT_EQ(j["settings"].size(), 1U) << j;
  EXPECT_EQ(j["settings"][0]["name"], "repair");
  EXPECT_EQ(j["sections"], Json::array({"record"}));
}

// The numbers of a mesh of the samples in OFF and PLY, with the digits of its OBJ.
void write_other_formats(const TemporaryFolder& folder, const std::string& obj) {
  std::istringstream lines(obj);
  std::string vertices, faces, word;
  int vertex_count = 0, face_count = 0;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    words >> word;
    if (word == "v") {
      vertices += line.substr(2) + "\n";
      ++vertex_count;
    } else if (word == "f") {
      int a = 0, b = 0, c = 0;
      words >> a >> b >> c;
      faces += "3 " + std::to_string(a - 1) + " " + std::to_string(b - 1) + " " + std::to_string(c - 1) + "\n";
      ++face_count;
    }
  }
  const std::string v = std::to_string(vertex_count), f = std::to_string(face_count);
  write_file(folder / "m.off", "OFF\n" + v + " " + f + " 0\n" + vertices + faces);
  write_file(folder / "m.ply", "ply\nformat ascii 1.0\nelement vertex " + v +
                                   "\nproperty double x\nproperty double y\nproperty double z\nelement face " + f +
                                   "\nproperty list uchar int vertex_indices\nend_header\n" + vertices + faces);
}

TEST(Compare, OneGeometryInThreeFormatsDiffersInItsRecordAlone) {
  const TemporaryFolder folder;
  const std::string obj = read_file(sample("nut"));
  write_file(folder / "m.obj", obj);
  write_other_formats(folder, obj);
  for (const std::string format : {"obj", "off", "ply"}) {
    const Outcome run = vpsbake(folder, "m." + format + " --resolution 32 -o " + format + ".vps.hdf");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  for (const std::string other : {"off", "ply"}) {
    const Json j = compared(folder, "obj.vps.hdf " + other + ".vps.hdf", 0);
    EXPECT_EQ(j["same"], "content") << j;
    ASSERT_EQ(j["settings"].size(), 1U) << j;
    EXPECT_EQ(j["settings"][0]["name"], "mesh");
    EXPECT_EQ(j["sections"], Json::array({"record"}));
  }
}

TEST(Compare, OtherVoxelsAreNamedAndFieldsDifferByNoMoreThanTheirErrors) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("icosphere") + " --voxel 2mm --fields scaled,real -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, sample("icosphere") + " --voxel 3mm --fields scaled -o b.vps.hdf").code, 0);
  const Json j = compared(folder, "a.vps.hdf b.vps.hdf", 5);
  EXPECT_EQ(j["same"], "nothing");
  bool named = false;
  for (const Json& setting : j["settings"]) {
    if (setting["name"] != "voxel_size") continue;
    named = setting["a"] == "0.002" && setting["b"] == "0.003";
  }
  EXPECT_TRUE(named) << j["settings"];
  ASSERT_EQ(j["fields"].size(), 1U);
  const Json& field = j["fields"][0];
  EXPECT_EQ(field["field"], "scaled");
  EXPECT_GT(field["points"], 10000);
  EXPECT_GT(field["only_b"], field["only_a"]);  // b has a wider band
  const auto bound = [&](const char* file) {
    return Json::parse(vpsbake(folder, std::string("info ") + file + " --json").out)["certificate"]["scaled"]["bound"]
        .get<double>();
  };
  EXPECT_GT(field["max"], 0);
  EXPECT_LE(field["rms"], field["p99"]);
  EXPECT_LE(field["p99"], field["max"]);
  EXPECT_LE(field["p99"].get<double>(), bound("a.vps.hdf") + bound("b.vps.hdf"));
  const double spacing = 0.003 * std::numbers::sqrt2;
  EXPECT_LE(j["shell"]["a_to_b"]["max"].get<double>(), 1.2 * spacing);
  EXPECT_NE(j["shell"]["points"][0], j["shell"]["points"][1]);
}

TEST(Compare, AShiftIsFoundInFieldsAndShells) {
  constexpr double kShift = 0.0004;
  const TemporaryFolder folder;
  write_file(folder / "a.obj", box_at(0));
  write_file(folder / "b.obj", box_at(kShift));
  for (const char* const name : {"a", "b"}) ASSERT_EQ(vpsbake(folder, std::string(name) + ".obj --voxel 1mm").code, 0);
  const Json j = compared(folder, "a.vps.hdf b.vps.hdf", 5);
  const Json& field = j["fields"][0];
  EXPECT_NEAR(field["p99"].get<double>(), kShift, 0.0001);
  EXPECT_LE(field["max"].get<double>(), kShift + 0.0005);
  for (const char* const way : {"a_to_b", "b_to_a"}) {
    EXPECT_GE(j["shell"][way]["max"].get<double>(), kShift - 1e-6);
    EXPECT_LE(j["shell"][way]["max"].get<double>(), 0.0015);
  }
  EXPECT_NEAR(j["shell"]["area"][0].get<double>(), 0.0024, 1e-6);
  std::set<std::string> facts;
  for (const Json& fact : j["facts"]) facts.insert(fact["name"]);
  EXPECT_TRUE(facts.contains("mass/centre_of_mass/0"));
  EXPECT_FALSE(facts.contains("mesh/triangles"));
}

TEST(Compare, JsonFollowsItsSchema) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 6mm --parts voxelmap -o b.vps.hdf").code, 0);
  for (const char* const files : {"a.vps.hdf a.vps.hdf", "a.vps.hdf b.vps.hdf"}) {
    write_file(folder / "a.json", vpsbake(folder, std::string("compare --json ") + files).out);
    EXPECT_TRUE(follows_schema(folder / "a.json", "compare.schema.json")) << files;
  }
}

TEST(Info, TellsWhatSeveralAssetsWereBakedFrom) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o a.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 6mm -o b.vps.hdf").code, 0);
  const Json list = Json::parse(vpsbake(folder, "info a.vps.hdf b.vps.hdf --json").out);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0]["record"]["voxel_size"], "0.005");
  EXPECT_EQ(list[1]["record"]["voxel_size"], "0.006");
  EXPECT_NE(list[0]["xxh3_64"], list[1]["xxh3_64"]);
  const Outcome some = vpsbake(folder, "info missing.vps.hdf a.vps.hdf --json");
  EXPECT_EQ(some.code, 5);
  const Json both = Json::parse(some.out);
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[0], Json({{"file", "missing.vps.hdf"}, {"error", "the file does not exist; check its name"}}));
  EXPECT_EQ(both[1]["file"], "a.vps.hdf");
  const Outcome text = vpsbake(folder, "info missing.vps.hdf a.vps.hdf");
  EXPECT_EQ(text.code, 5);
  EXPECT_NE(text.out.find("baked from\n"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("5 mm"), std::string::npos) << text.out;
  VPS_SCHEMA_CHECK_OR_SKIP();
  write_file(folder / "a.json", vpsbake(folder, "info a.vps.hdf --json").out);
  EXPECT_TRUE(follows_schema(folder / "a.json", "asset.schema.json"));
}

TEST(Compare, WhatIsNoAssetIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(vpsbake(folder, sample("cube") + " --voxel 5mm -o a.vps.hdf").code, 0);
  expect_refusal(folder, "compare a.vps.hdf missing.vps.hdf", 2, "missing.vps.hdf");
  expect_refusal(folder, "compare a.vps.hdf " + sample("icosphere"), 3, "this is not a vpsbake asset");
  expect_refusal(folder, "compare a.vps.hdf", 1, "OTHER is required; run vpsbake compare --help");
}

}  // namespace
}  // namespace vps::test

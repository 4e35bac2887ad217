// SPDX-License-Identifier: GPL-3.0-or-later
// Runs `vpsbake recommend` end to end, as a user does.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/lab/assets.h"
#include "cli/lab/ours.h"
#include "cli/lab/poses.h"
#include "formats/mesh/mesh_import.h"
#include "tests/cli/lab/cracked_cube.h"
#include "tests/cli/program.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

using Json = nlohmann::json;

TEST(Recommend, WhatItRecommendsForACrackedMeshCanBeBaked) {
  const TemporaryFolder folder;
  write_cracked_cube(folder / "crack.obj");
  const Outcome run = vpsbake(folder, "recommend crack.obj --max-error 0.5mm --poses 6 --json");
  const Json json = Json::parse(run.out);
  EXPECT_FALSE(json["tried"].empty());
  for (const Json& tried : json["tried"]) {
    const std::string command = tried["command"].get<std::string>().substr(std::string("vpsbake ").size());
    const Outcome bake = vpsbake(folder, command + " -o crack.vps.hdf");
    EXPECT_EQ(bake.code, 0) << bake.err;
  }
}

TEST(Recommend, GoesCoarserThanItsFirstSettingsWhereTheLimitsAskForIt) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(folder, "recommend " + sample("icosphere") + " --max-bytes 60kB --poses 6 --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json json = Json::parse(run.out);
  const Json& chosen_one = json["tried"][json["chosen"].get<std::size_t>()];
  EXPECT_GT(chosen_one["voxel_size"], 0.1 / 64);
  EXPECT_LE(json["tried"][json["chosen"].get<std::size_t>()]["bytes"], 60000);
}

// The first settings that are small enough miss contacts deeper than half of the deepest pose, and so do coarser ones.
TEST(Recommend, SeeksBetweenSettingsThatAreTooLargeAndOnesThatMissTooDeepContacts) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(folder, "recommend " + sample("torus") + " --max-bytes 60kB --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json json = Json::parse(run.out);
  const Json& chosen = json["tried"][json["chosen"].get<std::size_t>()];
  EXPECT_LE(chosen["bytes"], 60000);
  EXPECT_LE(chosen["deepest_missed"], json["limits"]["missed"]);
}

TEST(Recommend, BakesWhatItMeasured) {
  const TemporaryFolder folder;
  const std::string ball = sample("icosphere");
  const Outcome run = vpsbake(folder, "recommend " + ball + " --max-error 2mm --poses 6 --cache cache --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json json = Json::parse(run.out);
  const Json& chosen = json["tried"][json["chosen"].get<std::size_t>()];
  EXPECT_LE(chosen["error"], 0.002);
  EXPECT_TRUE(chosen["exceeds"].empty());
  const auto time = [](const Json& tried) { return tried["time_us"].get<double>(); };
  const auto noise = [](const Json& tried) { return tried["time_noise_us"].get<double>(); };
  Json fastest = chosen;
  for (const Json& tried : json["tried"]) {
    if (tried["exceeds"].empty() && time(tried) < time(fastest)) fastest = tried;
  }
  EXPECT_LE(time(chosen) - noise(chosen), time(fastest) + noise(fastest));
  for (const Json& tried : json["tried"]) {
    if (tried["exceeds"].empty() && tried["bytes"] < chosen["bytes"]) {
      EXPECT_GT(time(tried) - noise(tried), time(fastest) + noise(fastest)) << tried["command"];
    }
  }
  // Contacts as deep as the limit are measured, and those deeper than half of it are not missed.
  EXPECT_EQ(json["poses"]["deepest"], 0.002);
  EXPECT_EQ(json["limits"]["missed"], 0.001);
  EXPECT_LE(chosen["deepest_missed"], 0.001);
  // The printed command bakes the asset that was measured.
  const std::string command = chosen["command"].get<std::string>().substr(std::string("vpsbake ").size());
  const Outcome bake = vpsbake(folder, command + " -o ball.vps.hdf --json");
  ASSERT_EQ(bake.code, 0) << bake.err;
  EXPECT_EQ(Json::parse(bake.out)["bytes"], chosen["bytes"]);
  VPS_SCHEMA_CHECK_OR_SKIP();
  write_file(folder / "recommend.json", run.out);
  EXPECT_TRUE(follows_schema(folder / "recommend.json", "recommend.schema.json"));
}

TEST(Recommend, ItsPromiseHoldsForPosesThatItHasNotSeen) {
  const TemporaryFolder folder;
  const std::string torus = sample("torus");
  constexpr double kLimit = 0.001;
  const Outcome run = vpsbake(folder, "recommend " + torus + " --max-error 1mm --json");
  ASSERT_EQ(run.code, 0) << run.err;
  const Json json = Json::parse(run.out);
  const Json& chosen = json["tried"][json["chosen"].get<std::size_t>()];
  const std::string command = chosen["command"].get<std::string>().substr(std::string("vpsbake ").size());
  ASSERT_EQ(vpsbake(folder, command + " -o torus.vps.hdf").code, 0);
  const auto asset = std::make_shared<Asset>();
  ASSERT_EQ(Asset::open((folder / "torus.vps.hdf").c_str(), *asset), Status::ok);

  const TriangleMesh body = lab::centred(import_mesh(torus), *asset);
  lab::PoseOptions options;
  options.ranges = {{20, -json["poses"]["farthest"].get<double>(), 0}, {60, 0, json["poses"]["deepest"]}};
  options.seed = 4711;
  const auto traverse = lab::our_traverse(asset);
  const auto separation = lab::our_separation(asset);
  std::size_t within = 0;
  double worst = 0;
  const std::vector<lab::PairPose> poses = lab::pair_poses(body, options, {});
  for (const lab::PairPose& pose : poses) {
    const double told = (pose.depth < 0 ? *separation : *traverse).query(pose.first_in_second).depth;
    worst = std::max(worst, std::abs(told - pose.depth));
    within += std::abs(told - pose.depth) <= kLimit;
  }
  EXPECT_GE(double(within), 0.95 * double(poses.size()));
  EXPECT_LE(worst, 1.5 * kLimit);
  EXPECT_GT(worst, 0.1 * kLimit);  // not much finer than required
}

TEST(Recommend, SaysWhyAndWhatCannotBeMetTogether) {
  const TemporaryFolder folder;
  const std::string options = "recommend " + sample("icosphere") + " --poses 6 --cache cache --max-error 2mm";
  const Outcome run = vpsbake(folder, options);
  ASSERT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(run.out.starts_with("vpsbake ")) << run.out;
  EXPECT_NE(run.out.find("\nwhy: off by "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("     error bound of the field, by its certificate: "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("whole steps on a box in Bullet, median / 99 %: landing "), std::string::npos) << run.out;
  const Outcome none = vpsbake(folder, options + " --max-bytes 1kB");
  EXPECT_EQ(none.code, 3);
  EXPECT_EQ(none.out, "");
  EXPECT_NE(none.err.find("no setting that was tried keeps within the limits; the nearest, `vpsbake "),
            std::string::npos);
  EXPECT_EQ(std::count(none.err.begin(), none.err.end(), '\n'), 1);
  std::ofstream(folder.path() / "sheet.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  expect_refusal(folder, "recommend sheet.obj --max-error 1mm", 3, "sheet.obj: the mesh is open");
  expect_refusal(folder, "recommend " + sample("cube") + " --max-error 1um", 3,
                 "no voxel size tried reaches an error of 1 um: voxels of 4.34 um make a grid of more than 16384");
  expect_refusal(folder, "recommend " + sample("icosphere"), 1, "--max-error, --max-time or --max-bytes is required");
  expect_refusal(folder, "recommend " + sample("icosphere") + " --max-time 20", 1, "needs a unit");
  expect_refusal(folder, "recommend absent.obj --max-error 1mm --cache sheet.obj/a", 2,
                 "choose another folder for --cache");
}

}  // namespace
}  // namespace vps::test

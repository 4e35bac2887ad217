// SPDX-License-Identifier: GPL-3.0-or-later
// What the line of progress shows.
#include "cli/terminal/estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/cli/program.h"
#include "tests/cli/scene/scene_plan.h"
#include "tests/cli/terminal/terminal.h"

namespace vps::test {
namespace {

using cli::Estimate;

// Asks ten times a second while stages with these weights take these times.
std::vector<Estimate::Shown> watched(const std::vector<double>& weights, const std::vector<double>& seconds) {
  const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
  Estimate estimate;
  std::vector<Estimate::Shown> seen;
  double begin = 0;
  double done = 0;
  for (std::size_t stage = 0; stage < weights.size(); ++stage) {
    estimate.report(done / total, begin);
    for (int n = 0; n < 10 * seconds[stage]; ++n) seen.push_back(estimate.at(begin + n / 10.0));
    begin += seconds[stage];
    done += weights[stage];
  }
  return seen;
}

TEST(Estimate, RisesAllTheTimeHoweverWrongTheWeightsAre) {
  const std::vector<double> weights = {12, 11, 21, 8, 15, 33};
  for (const std::vector<double>& seconds :
       {weights, {1, 1, 58, 1, 15, 3}, {0.5, 30, 1, 1, 1, 1}, {30, 1, 1, 1, 1, 1}}) {
    const std::vector<Estimate::Shown> seen = watched(weights, seconds);
    const auto known = std::find_if(seen.begin(), seen.end(), [](const auto& shown) { return shown.left >= 0; });
    EXPECT_LE(known - seen.begin(), 10 * seconds[0] + 2) << "known when the first stage is done";
    for (auto it = known + 1; it < seen.end(); ++it) {
      ASSERT_GT(it->fraction, (it - 1)->fraction);
      ASSERT_LT(it->fraction, 0.99);
    }
  }
}

TEST(Estimate, IsRightWhereTheWeightsAre) {
  const std::vector<double> weights = {10, 10, 10, 10, 10, 10, 10, 10, 10, 10};
  const std::vector<Estimate::Shown> seen = watched(weights, weights);
  for (std::size_t i = 200; i < seen.size(); ++i) {
    EXPECT_NEAR(seen[i].fraction, double(i) / 1000, 0.06) << i;
    EXPECT_NEAR(seen[i].left, 100 - double(i) / 10, 0.35 * (100 - double(i) / 10) + 6) << i;
  }
}

TEST(Estimate, NothingIsKnownBeforeTheFirstReport) {
  Estimate estimate;
  EXPECT_LT(estimate.at(3).left, 0);
  estimate.report(0.5, 4);
  EXPECT_NEAR(estimate.at(4).left, 4, 1e-9);
  estimate.report(0.25, 5);  // lower than before
  EXPECT_GT(estimate.at(5).fraction, 0.5);
}

TEST(Estimate, FollowsAPaceThatChanges) {
  Estimate estimate;
  estimate.report(0.1, 10);  // slow
  for (int n = 1; n <= 50; ++n) estimate.report(0.1 + n * 0.01, 10 + n * 0.1);
  // 40 % are left, which take 4 s at the present pace, and 10 s at that of all the time.
  EXPECT_GT(estimate.at(15).left, 4);
  EXPECT_LT(estimate.at(15).left, 7);
}

// The line is painted four times a second, so that a bake of seconds gives several lines even on a busy machine.
TEST(Progress, FiguresOfABakeRiseWhileAStageRuns) {
  const TemporaryFolder folder;
  const std::string out =
      on_terminal(folder, "TERM=xterm", sample("gear") + " --voxel 0.12mm --parts voxelmap -o gear.vps.hdf", 300);
  const std::regex line("\033\\[K([a-z][a-z :]*) ([0-9]+) %, ([0-9]+) s left");
  std::map<std::string, std::vector<int>> percents;  // by stage
  std::vector<int> all;
  for (std::sregex_iterator it(out.begin(), out.end(), line), end; it != end; ++it) {
    all.push_back(std::stoi((*it)[2]));
    percents[(*it)[1]].push_back(all.back());
    EXPECT_GE(std::stoi((*it)[3]), 1);
  }
  ASSERT_GE(all.size(), 4U) << out;
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end())) << out;
  EXPECT_LT(all.front(), 50) << out;
  EXPECT_GT(all.back(), 50) << out;
  const std::vector<int>& distances = percents["distances"];
  ASSERT_GE(distances.size(), 3U) << out;
  EXPECT_GT(distances.back(), distances.front() + 10) << out;
  EXPECT_GT(std::set<int>(distances.begin(), distances.end()).size(), distances.size() / 2) << out;
}

TEST(Progress, OfASceneNamesTheMeshAndRisesOverAllBakes) {
  const TemporaryFolder folder;
  write_file(folder / "scene.toml",
             std::string(kPlane) + body("gear", "gear", "mass = \"20g\"") + body("torus", "torus", "mass = \"20g\""));
  const std::string out = on_terminal(folder, "TERM=xterm", "scene scene.toml", 300);
  const std::regex line("\033\\[K([a-z]+)\\.obj: [a-z ]+ ([0-9]+) %, [0-9]+ s left");
  std::vector<int> all, gear;
  for (std::sregex_iterator it(out.begin(), out.end(), line), end; it != end; ++it) {
    all.push_back(std::stoi((*it)[2]));
    if ((*it)[1] == "gear") gear.push_back(all.back());
  }
  ASSERT_GE(gear.size(), 2U) << out;
  EXPECT_LT(gear.front(), 50) << out;
  EXPECT_LT(gear.back(), 90) << "the torus is left: " << out;
  EXPECT_TRUE(std::is_sorted(all.begin(), all.end())) << out;
  EXPECT_NE(out.find("\033[Kscene.toml: 3 bodies"), std::string::npos) << out;
  EXPECT_EQ(on_terminal(folder, "TERM=xterm", "scene scene.toml -q --dry-run"), "");
}

}  // namespace
}  // namespace vps::test

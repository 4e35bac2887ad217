// SPDX-License-Identifier: GPL-3.0-or-later
// What the line of progress shows.
#include "cli/terminal/estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/cli/program.h"
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

TEST(Progress, NoFigureOfABakeStandsForLong) {
  const TemporaryFolder folder;
  const std::string out =
      on_terminal(folder, "TERM=xterm", sample("gear") + " --voxel 0.12mm --parts voxelmap -o gear.vps.hdf", 300);
  const std::regex line("\033\\[K([a-z][a-z :]*)( [^\033\n]+)");
  std::set<std::string> names;
  std::set<std::string> figures;
  std::string last;
  std::size_t same = 0;
  for (std::sregex_iterator it(out.begin(), out.end(), line), end; it != end; ++it) {
    const std::string text = (*it)[1].str() + (*it)[2].str();
    EXPECT_LT(text.size(), 100U);
    // Four lines a second.
    same = text == last ? same + 1 : 0;
    EXPECT_LT(same, 10U) << text;
    last = text;
    names.insert((*it)[1]);
    figures.insert(text);
  }
  EXPECT_GT(figures.size(), names.size()) << "figures rise while a stage runs: " << out;
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stage_graph.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/support/random.h"

namespace vps::test {

using namespace bake;

TEST(StageGraph, EachStageSeesTheResultsOfThoseItNeeds) {
  Random random(1);
  for (int n = 0; n < 200; ++n) {
    StageGraph graph(nullptr);
    constexpr std::size_t kStages = 20;
    std::array<std::uint64_t, kStages> results{};
    std::array<std::uint64_t, kStages> expected{};
    for (std::size_t stage = 0; stage < kStages; ++stage) {
      std::vector<std::size_t> after;
      for (std::size_t before = 0; before < stage; ++before) {
        if (random.next() < 0.2) after.push_back(before);
      }
      after.resize(std::min<std::size_t>(after.size(), 2));
      expected[stage] = stage + 1;
      for (const std::size_t before : after) expected[stage] += 3 * expected[before];
      const auto work = [&results, stage, after] {
        // Parallel work of its own, as real stages have.
        std::array<std::uint64_t, 64> parts{};
        tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t i) {
          if (i == 0) parts[i] = stage + 1;
          for (const std::size_t before : after) parts[i] += i < 3 ? results[before] : 0;
        });
        results[stage] = std::accumulate(parts.begin(), parts.end(), std::uint64_t{0});
      };
      if (after.empty()) graph.add("root", {}, work);
      if (after.size() == 1) graph.add("one", {after[0]}, work);
      if (after.size() == 2) graph.add("two", {after[0], after[1]}, work);
    }
    graph.run();
    ASSERT_EQ(results, expected);
  }
}

TEST(StageGraph, ProgressRisesToOneWithOneCallForEachStage) {
  std::vector<double> fractions;
  std::string last;
  StageGraph graph([&](const char* stage, double fraction) {
    last = stage;
    fractions.push_back(fraction);
  });
  const auto first = graph.add("first", {}, [] {});
  for (int n = 0; n < 8; ++n) graph.add("more", {first}, [] {});
  graph.run();
  ASSERT_EQ(fractions.size(), 10U);
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_EQ(fractions.front(), 0);
  EXPECT_LE(fractions[8], 8.0 / 9);
  EXPECT_EQ(fractions.back(), 1);
  EXPECT_EQ(last, "done");
}

TEST(StageGraph, ProgressFollowsTheExpectedTimesAndTheWorkOfAStage) {
  std::vector<double> fractions;
  StageGraph graph([&](const char*, double fraction) { fractions.push_back(fraction); });
  StageGraph::Stage longer = 0;
  const auto first = graph.add("short", {}, [] {});
  longer = graph.add("long", {first}, [&] {
    graph.advance(longer, 0.5);
    graph.advance(longer, 0.25);  // lower than before
  });
  graph.add("other", {longer}, [] {});
  graph.expect([](const char* name) { return std::string(name) == "long" ? 8 : 1; });
  graph.run();
  EXPECT_EQ(fractions, (std::vector<double>{0, 0.1, 0.5, 0.5, 0.9, 1}));
}

TEST(StageGraph, AFailureEndsTheRunBeforeTheStagesThatNeedIt) {
  for (int n = 0; n < 20; ++n) {
    StageGraph graph(nullptr);
    bool reached = false;
    const auto good = graph.add("good", {}, [] {});
    const auto bad = graph.add("bad", {good}, [] { throw std::runtime_error("reason"); });
    graph.add("after", {bad}, [&] { reached = true; });
    try {
      graph.run();
      ADD_FAILURE() << "nothing was thrown";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "reason");
    }
    EXPECT_FALSE(reached);
  }
}

TEST(StageGraph, TheCriticalPathIsTheLongestOne) {
  StageGraph graph(nullptr);
  const auto wait = [](int ms) { return [ms] { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }; };
  const auto first = graph.add("first", {}, wait(5));
  const auto slow = graph.add("slow", {first}, wait(60));
  const auto quick = graph.add("quick", {first}, wait(5));
  const auto joined = graph.add("joined", {quick, slow}, wait(5));
  graph.add("last", {joined}, wait(5));
  graph.add("beside", {quick}, wait(20));
  graph.run();
  std::string path;
  double seconds = 0;
  for (const StageTime& time : graph.times()) {
    if (!time.critical) continue;
    path += time.stage + " ";
    seconds += time.seconds;
  }
  EXPECT_EQ(path, "first slow joined last ");
  EXPECT_GE(seconds, 0.075);
}

}  // namespace vps::test

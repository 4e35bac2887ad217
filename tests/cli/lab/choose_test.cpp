// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "cli/lab/recommend.h"

namespace vps::test {
namespace {

struct Measured {
  std::size_t bytes = 0;
  double us = 0;
  double error = 0;
};

lab::Tried tried(const Measured& n) {
  lab::Tried out;
  out.bytes = n.bytes;
  out.field_bound = n.error;
  out.steps.scenes[0].whole = {2, n.us, n.us, n.us, 1, 1, 1};
  return out;
}

lab::Recommendation chosen_of(const std::vector<lab::Tried>& tried, const lab::Limits& limits) {
  lab::Recommendation out;
  out.tried = tried;
  out.limits = limits;
  lab::choose(out);
  return out;
}

const std::vector<lab::Tried> kTried = {tried({300, 10, 1}), tried({100, 20, 3}), tried({200, 11, 2})};

TEST(Choose, WithALimitOnTheErrorTheFastestStepsWinAndOfEquallyFastSettingsTheSmallestFile) {
  lab::Limits limits;
  limits.error = 4;
  EXPECT_EQ(chosen_of(kTried, limits).chosen, 1U);  // by bytes; 10 and 11 us are within the noise
  limits.error = 1;
  EXPECT_EQ(chosen_of(kTried, limits).chosen, 2U);
  limits.error = 0.5;
  const lab::Recommendation none = chosen_of(kTried, limits);
  EXPECT_FALSE(none.chosen);
  EXPECT_EQ(none.nearest, 2U);
}

TEST(Choose, WithoutALimitOnTheErrorTheSmallestErrorWins) {
  lab::Limits limits;
  limits.bytes = 250;
  EXPECT_EQ(chosen_of(kTried, limits).chosen, 1U);
  limits.bytes = 0;
  limits.microseconds = 12;  // with the noise
  EXPECT_EQ(chosen_of(kTried, limits).chosen, 2U);
}

TEST(Choose, ASettingThatMissesDeeperContactsThanTheLimitOrFallsThroughTheBoxExceedsItsLimits) {
  lab::Tried tried;
  lab::Limits limits;
  limits.error = 1;
  limits.missed = 0.5;
  tried.field_bound = 1;
  tried.missed = 1;
  tried.deepest_missed = 0.5;
  EXPECT_TRUE(tried.exceeds(limits).empty());
  tried.deepest_missed = 0.6;
  ASSERT_EQ(tried.exceeds(limits).size(), 1U);
  EXPECT_EQ(tried.exceeds(limits)[0], "misses contacts up to 600 mm deep");
  tried.deepest_missed = 0;
  tried.steps.failure = "falls through a box";
  EXPECT_EQ(tried.exceeds(limits), std::vector<std::string>{"falls through a box"});
}

TEST(Choose, ASettingThatMissesContactsDeeperThanItsErrorIsNeverChosen) {
  lab::Limits limits;
  limits.bytes = 500;
  std::vector<lab::Tried> some = {tried({100, 10, 0.1}), tried({200, 20, 0.3})};
  some[0].missed = 1;
  some[0].deepest_missed = 0.2;
  EXPECT_EQ(chosen_of(some, limits).chosen, 1U) << "though the other has the smaller error";
  some[1].deepest_missed = 0.4;
  EXPECT_FALSE(chosen_of(some, limits).chosen);
}

}  // namespace
}  // namespace vps::test

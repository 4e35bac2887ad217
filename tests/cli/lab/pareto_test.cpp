// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/pareto.h"

#include <gtest/gtest.h>

#include <limits>

#include "cli/lab/random.h"

namespace vps::test {
namespace {

using lab::Candidate;
using Front = std::vector<std::size_t>;

TEST(Pareto, HasWhatNoOtherBeatsInBothFromTheCheapest) {
  const std::vector<Candidate> candidates = {{5, 1}, {1, 9}, {2, 4}, {3, 4}, {4, 5}, {9, 1}};
  EXPECT_EQ(lab::pareto_front(candidates), (Front{1, 2, 0}));
}

TEST(Pareto, OfEqualOnesTheFirstIsTaken) {
  const std::vector<Candidate> candidates = {{2, 2}, {2, 2}, {2, 3}};
  EXPECT_EQ(lab::pareto_front(candidates), Front{0});
}

TEST(Pareto, WhatIsNotKnownIsNotOnIt) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Candidate> candidates = {{nan, 0}, {0, nan}, {7, 7}};
  EXPECT_EQ(lab::pareto_front(candidates), Front{2});
  EXPECT_TRUE(lab::pareto_front({}).empty());
}

TEST(Pareto, EveryCandidateIsOnItOrBeatenByOneThatIs) {
  lab::Random random(7);
  std::vector<Candidate> candidates(500);
  for (Candidate& c : candidates) c = {std::floor(random.between(0, 40)), std::floor(random.between(0, 40))};
  const Front front = lab::pareto_front(candidates);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    bool reached = false;
    for (const std::size_t f : front) {
      const bool no_worse = candidates[f].cost <= candidates[i].cost && candidates[f].error <= candidates[i].error;
      reached = reached || no_worse;
      const bool worse = candidates[i].cost < candidates[f].cost || candidates[i].error < candidates[f].error;
      EXPECT_TRUE(worse || !(candidates[i].cost <= candidates[f].cost) ||
                  !(candidates[i].error <= candidates[f].error) ||
                  (candidates[i].cost == candidates[f].cost && candidates[i].error == candidates[f].error));
    }
    EXPECT_TRUE(reached) << i;
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Queries whose working memory cannot grow.
#include <gtest/gtest.h>

#include "runtime/vps_contacts.h"
#include "runtime/vps_queries.h"
#include "tests/runtime/pair.h"
#include "tests/support/count_allocations.h"

namespace vps::test {
namespace {

// Every allocation fails while this lives.
struct NoMemory {
  NoMemory() { allocations_fail = true; }
  NoMemory(const NoMemory&) = delete;
  NoMemory& operator=(const NoMemory&) = delete;
  ~NoMemory() { allocations_fail = false; }
};

TEST(NoMemory, QueriesReturnAStatusAndWorkLater) {
  const Pair s(Field::scaled);
  const Pose pose;
  std::vector<Contact> out(s.shell.points);
  Scratch scratch;
  const auto ask_all = [&](Status wanted) {
    QueryResult result;
    EXPECT_EQ(traverse(s.shell, s.map, pose, {}, scratch, out, result), wanted);
    SeparationResult apart;
    EXPECT_EQ(separation(s.shell, s.map, pose, {}, scratch, apart), wanted);
    Sweep sweep;
    sweep.duration = 1;
    ImpactResult impact;
    EXPECT_EQ(time_of_impact(s.shell, s.map, sweep, {}, scratch, impact), wanted);
  };
  {
    const NoMemory none;
    ask_all(Status::no_memory);
  }
  ask_all(Status::ok);
}

TEST(NoMemory, ABatchAndAReductionReturnAStatus) {
  const Pair s(Field::scaled);
  std::vector<Contact> all(100);
  std::vector<Contact> kept(4);
  const PairQuery query{&s.shell, &s.map, {}, {}, {}, all};
  PairAnswer answer;
  BatchScratch batch;
  ReductionScratch reduction;
  Reduction reduced;
  const NoMemory none;
  EXPECT_EQ(traverse_batch({&query, 1}, {&answer, 1}, batch, {}), Status::no_memory);
  EXPECT_EQ(reduce_contacts(all, {}, kept, reduction, reduced), Status::no_memory);
}

TEST(NoMemory, ACacheThatCannotGrowHoldsNothing) {
  const Pair s(Field::scaled);
  const Pose pose;
  std::vector<Contact> out(s.shell.points);
  Scratch scratch;
  scratch.reserve(s.shell);
  ContactCache cache;
  QueryOptions options;
  QueryResult plain;
  ASSERT_EQ(traverse(s.shell, s.map, pose, options, scratch, out, plain), Status::ok);
  ASSERT_GT(plain.contacts, 0U);
  options.cache = &cache;
  const NoMemory none;
  for (int n = 0; n < 4; ++n) {
    QueryResult result;
    ASSERT_EQ(traverse(s.shell, s.map, pose, options, scratch, out, result), Status::ok);
    EXPECT_EQ(result.contacts, plain.contacts);
    EXPECT_EQ(cache.reach, 0);
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "runtime/vps_contacts.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

constexpr std::size_t kRoom = 100;

// Bodies at random poses, most of them apart.
struct Crowd {
  Pair pair;
  std::vector<PairQuery> queries;

  explicit Crowd(std::size_t count) {
    Random random;
    for (std::size_t i = 0; i < count; ++i) {
      PairQuery query;
      query.shell = &pair.shell;
      query.map = &pair.map;
      query.shell_pose = random_pose(random, 0.3);
      query.map_pose = random_pose(random, 0.1);
      query.options.segment_level = i % 5 == 0 ? 3 : 0;
      queries.push_back(query);
    }
  }
  struct Answers {
    std::vector<PairAnswer> answers;
    std::vector<Contact> contacts;
  };
  Answers answer(const Executor& executor, BatchScratch& scratch) {
    Answers out{std::vector<PairAnswer>(queries.size()), std::vector<Contact>(kRoom * queries.size())};
    for (std::size_t i = 0; i < queries.size(); ++i) {
      queries[i].out = std::span(out.contacts).subspan(kRoom * i, kRoom);
    }
    EXPECT_EQ(traverse_batch(queries, out.answers, scratch, executor), Status::ok);
    return out;
  }
};

void run_backwards(void* calls, std::uint32_t workers, Executor::Task task, void* batch) {
  ++*static_cast<int*>(calls);
  for (std::uint32_t worker = workers; worker-- > 0;) task(batch, worker);
}

void expect_same(const QueryResult& a, const QueryResult& b) {
  ASSERT_EQ(a.delta, b.delta);
  ASSERT_EQ(a.delta_bound, b.delta_bound);
  for (int axis = 0; axis < 3; ++axis) {
    ASSERT_EQ(a.force[axis], b.force[axis]);
    ASSERT_EQ(a.torque[axis], b.torque[axis]);
  }
  ASSERT_EQ(a.contacts, b.contacts);
  ASSERT_EQ(a.nodes_tested, b.nodes_tested);
  ASSERT_EQ(a.points_tested, b.points_tested);
}

TEST(TraverseBatch, AnswersAreThoseOfSingleQueriesForAnyNumberOfThreads) {
  Crowd crowd(1000);
  BatchScratch scratch;
  const Crowd::Answers alone = crowd.answer({}, scratch);
  int touching = 0;
  int apart = 0;
  for (std::size_t i = 0; i < crowd.queries.size(); ++i) {
    const PairQuery& query = crowd.queries[i];
    std::vector<Contact> contacts(kRoom);
    QueryResult result;
    const Status status = traverse(*query.shell, *query.map, relative_pose(query.map_pose, query.shell_pose),
                                   query.options, crowd.pair.scratch, contacts, result);
    ASSERT_EQ(alone.answers[i].status, status);
    expect_same(alone.answers[i].result, result);
    ASSERT_EQ(std::memcmp(contacts.data(), &alone.contacts[kRoom * i], sizeof(Contact) * kRoom), 0);
    touching += result.contacts > 0;
    apart += result.nodes_tested == 1;
  }
  EXPECT_GT(touching, 20);
  EXPECT_GT(apart, 200);

  int calls = 0;
  const Executor backwards{3, run_backwards, &calls};
  for (const Executor& executor :
       {thread_executor(1), thread_executor(2), thread_executor(7), thread_executor(0), backwards}) {
    const Crowd::Answers others = crowd.answer(executor, scratch);
    for (std::size_t i = 0; i < crowd.queries.size(); ++i) {
      ASSERT_EQ(others.answers[i].status, alone.answers[i].status);
      expect_same(others.answers[i].result, alone.answers[i].result);
    }
    ASSERT_EQ(std::memcmp(others.contacts.data(), alone.contacts.data(), sizeof(Contact) * others.contacts.size()), 0);
  }
  EXPECT_EQ(calls, 1);
}

TEST(TraverseBatch, BadPairsGetAStatusAndLeaveTheOthersAlone) {
  Crowd crowd(4);
  crowd.queries[0].shell = nullptr;
  crowd.queries[1].map_pose.translation[0] = std::numeric_limits<double>::quiet_NaN();
  crowd.queries[2].options.contact_distance = -1;
  crowd.queries[2].shell_pose.translation[0] = 10;
  BatchScratch scratch;
  const Crowd::Answers found = crowd.answer({}, scratch);
  EXPECT_EQ(found.answers[0].status, Status::missing_part);
  EXPECT_EQ(found.answers[1].status, Status::bad_pose);
  EXPECT_EQ(found.answers[2].status, Status::bad_argument);
  EXPECT_EQ(found.answers[3].status, Status::ok);
  std::vector<PairAnswer> few(3);
  EXPECT_EQ(traverse_batch(crowd.queries, few, scratch, {}), Status::bad_argument);
  std::vector<PairAnswer> enough(4);
  EXPECT_EQ(traverse_batch(crowd.queries, enough, scratch, Executor{0, nullptr, nullptr}), Status::bad_argument);
  EXPECT_EQ(traverse_batch({}, {}, scratch, {}), Status::ok);
}

}  // namespace
}  // namespace vps::test

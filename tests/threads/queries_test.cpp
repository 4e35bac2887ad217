// SPDX-License-Identifier: GPL-3.0-or-later
// Queries of the runtime on one asset from many threads.
#include <gtest/gtest.h>

#include <cstring>

#include "runtime/vps.h"
#include "runtime/vps_contacts.h"
#include "runtime/vps_queries.h"
#include "tests/support/poses.h"
#include "tests/threads/threads.h"

namespace vps::test {
namespace {

constexpr std::size_t kQueries = 400;
constexpr std::size_t kRoom = 200;  // contacts of a query

// A gear 44 mm across, and poses of a second one near it.
struct Gears {
  Asset asset;
  VoxelmapView map;
  PointshellView shell;
  std::vector<Pose> poses;

  Gears() {
    EXPECT_EQ(Asset::open(asset_path, asset), Status::ok);
    EXPECT_EQ(asset.voxelmap(map), Status::ok);
    EXPECT_EQ(asset.pointshell(shell), Status::ok);
    Random random;
    for (std::size_t i = 0; i < kQueries; ++i) poses.push_back(random_pose(random, 0.04));
  }
};

// All results as numbers to compare.
using Answer = std::vector<double>;

Answer ask_all(const Gears& gears, const Pose& pose, Scratch& scratch) {
  Answer out;
  const auto keep = [&](auto... numbers) { (out.push_back(static_cast<double>(numbers)), ...); };
  const Vec3 at{static_cast<float>(pose.translation[0]), static_cast<float>(pose.translation[1]),
                static_cast<float>(pose.translation[2])};
  SeparationResult separated;
  keep(separation(gears.shell, gears.map, pose, {}, scratch, separated));
  keep(separated.delta, separated.delta_bound, separated.lower, separated.upper, separated.point);
  Sweep sweep;
  sweep.start = pose;
  for (int axis = 0; axis < 3; ++axis) sweep.velocity[axis] = -pose.translation[axis];
  ImpactResult impact;
  keep(time_of_impact(gears.shell, gears.map, sweep, {}, scratch, impact), impact.impact, impact.time);
  ClosestPoint closest;
  keep(closest_point(gears.map, at, {}, closest), closest.distance, closest.residual, closest.position.x);
  RayHit hit;
  keep(cast_ray(gears.map, {at, {0, 0, 1}}, {}, hit), hit.hit, hit.distance, hit.steps);
  keep(penetration(gears.map, at, {0, 0, 1}), penetration_bound(gears.map, at));
  keep(segment_level_for(gears.shell, 15));
  return out;
}

TEST(Threads, QueriesOfASharedAssetAnswerAsOneThreadDoes) {
  const Gears gears;
  const auto answers = [&](std::size_t workers) {
    std::vector<Answer> out(kQueries);
    deal_out(kQueries, workers, [&](std::size_t i) {
      Scratch scratch;
      out[i] = ask_all(gears, gears.poses[i], scratch);
    });
    return out;
  };
  const auto many = answers(kThreads);  // first, so that vector instructions are chosen in several threads at once
  EXPECT_EQ(many, answers(1));
}

TEST(Threads, OneFileIsOpenedVerifiedAndClosedByManyThreads) {
  Asset shared;
  ASSERT_EQ(Asset::open(asset_path, shared), Status::ok);
  std::vector<Status> found(4 * kThreads, Status::bad_argument);
  deal_out(found.size(), kThreads, [&](std::size_t i) {
    Asset own;
    found[i] = Asset::open(asset_path, own);
    if (found[i] == Status::ok) found[i] = own.verify();
    if (found[i] == Status::ok) found[i] = shared.verify();
  });
  for (const Status status : found) EXPECT_EQ(status, Status::ok);
}

TEST(Threads, ABatchAnswersAsOneThreadDoes) {
  const Gears gears;
  std::vector<PairQuery> queries(kQueries);
  BatchScratch scratch;
  struct Found {
    std::vector<PairAnswer> answers{kQueries};
    std::vector<Contact> contacts{kQueries * kRoom};
    std::vector<ContactCache> caches{kQueries};
  };
  // Two rounds: the first fills the caches, the second uses them.
  const auto answer = [&](const Executor& executor) {
    Found found;
    for (int round = 0; round < 2; ++round) {
      for (std::size_t i = 0; i < kQueries; ++i) {
        queries[i] = {&gears.shell, &gears.map, gears.poses[i],
                      {},           {},         std::span(found.contacts).subspan(kRoom * i, kRoom)};
        queries[i].options.cache = &found.caches[i];
        queries[i].options.segment_level = i % 5 == 0 ? 2 : 0;
      }
      EXPECT_EQ(traverse_batch(queries, found.answers, scratch, executor), Status::ok);
    }
    return found;
  };
  const Found many = answer(thread_executor(kThreads));
  const Found one = answer({});
  std::size_t touching = 0;
  for (std::size_t i = 0; i < kQueries; ++i) {
    ASSERT_EQ(many.answers[i].status, one.answers[i].status);
    const QueryResult& a = many.answers[i].result;
    const QueryResult& b = one.answers[i].result;
    ASSERT_EQ(a.delta, b.delta);
    ASSERT_EQ(a.contacts, b.contacts);
    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(a.force[axis], b.force[axis]);
    for (int axis = 0; axis < 3; ++axis) ASSERT_EQ(a.torque[axis], b.torque[axis]);
    touching += a.contacts > 0;
  }
  EXPECT_GT(touching, kQueries / 10);
  EXPECT_EQ(std::memcmp(many.contacts.data(), one.contacts.data(), sizeof(Contact) * one.contacts.size()), 0);
}

TEST(Threads, ABatchInCAnswersAsOneThreadDoes) {
  VpsAsset* asset = nullptr;
  const VpsVoxelmap* map = nullptr;
  const VpsPointshell* shell = nullptr;
  ASSERT_EQ(vps_asset_open(asset_path, &asset), vps_ok);
  ASSERT_EQ(vps_asset_voxelmap(asset, vps_field_finest, &map), vps_ok);
  ASSERT_EQ(vps_asset_pointshell(asset, &shell), vps_ok);
  Random random;
  std::vector<VpsPose> poses(kQueries);
  for (VpsPose& to : poses) {
    const Pose pose = random_pose(random, 0.04);
    std::copy_n(pose.rotation, 9, to.rotation);
    std::copy_n(pose.translation, 3, to.translation);
  }
  const auto answer = [&](std::uint32_t threads) {
    std::vector<VpsQueryResult> results(kQueries);
    VpsBatch* batch = nullptr;
    EXPECT_EQ(vps_batch_create(threads, &batch), vps_ok);
    EXPECT_EQ(vps_traverse_batch(batch, shell, vps_map_ref(map), kQueries, {poses.data(), sizeof(VpsPose)}, nullptr,
                                 {nullptr, 0}, 0, {results.data(), sizeof(VpsQueryResult)}),
              vps_output_full);
    vps_batch_destroy(batch);
    return results;
  };
  const auto many = answer(kThreads);
  EXPECT_EQ(std::memcmp(many.data(), answer(1).data(), kQueries * sizeof(VpsQueryResult)), 0);
  vps_asset_close(asset);
}

}  // namespace
}  // namespace vps::test

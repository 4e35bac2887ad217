// SPDX-License-Identifier: GPL-3.0-or-later
// `vpsbake cache stats|prune|verify`, and the cache's size limit during a bake.
#include <nlohmann/json.hpp>

#include "tests/cli/program.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

// A cache with three entries, in the order of their last use.
class CliCacheCommand : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* voxel : {"12mm", "11mm", "10mm"})
      ASSERT_EQ(vpsbake(folder_, sample("cube") + " -o a.vps.hdf --cache cache --voxel " + voxel).code, 0);
  }
  [[nodiscard]] Json run(const std::string& arguments, int code = 0) const {
    const Outcome outcome = vpsbake(folder_, "cache " + arguments + " --json --cache cache");
    EXPECT_EQ(outcome.code, code) << outcome.err;
    write_file(folder_ / "out.json", outcome.out);
    if (has_schema_check()) {
      EXPECT_TRUE(follows_schema(folder_ / "out.json", "cache.schema.json")) << outcome.out;
    }
    return Json::parse(outcome.out);
  }
  [[nodiscard]] std::string use(const std::string& voxel) const {
    const Outcome outcome = vpsbake(folder_, sample("cube") + " -o b.vps.hdf --cache cache --json --voxel " + voxel);
    return Json::parse(outcome.out)["cache"];
  }
  const TemporaryFolder folder_;
};

TEST_F(CliCacheCommand, CountsWhatTheFolderHolds) {
  const Json stats = run("stats");
  EXPECT_EQ(stats["entries"], 3);
  EXPECT_GT(stats["bytes"], 3 * 4096);
  EXPECT_EQ(stats["leftovers"], 0);
  EXPECT_LE(stats["oldest_use"], stats["newest_use"]);
  const Outcome text = vpsbake(folder_, "cache stats", "cache");
  EXPECT_TRUE(text.out.starts_with("cache: 3 entries, ")) << text.out;
  EXPECT_NE(text.out.find("\nlast used "), std::string::npos) << text.out;
}

TEST_F(CliCacheCommand, PrunesWhatWasUsedLeastRecently) {
  EXPECT_EQ(use("12mm"), "hit");  // the oldest is now the most recently used
  const std::string size = std::to_string(run("stats")["bytes"].get<int>() * 2 / 3) + "B";
  EXPECT_EQ(run("prune --max-size 1GB")["removed"], 0);
  const Json planned = run("prune --dry-run --max-size " + size);
  EXPECT_EQ(run("stats")["entries"], 3);
  const Json pruned = run("prune --max-size " + size);
  EXPECT_EQ(planned["removed"], pruned["removed"]);
  EXPECT_EQ(run("stats")["entries"], pruned["entries"]);
  EXPECT_EQ(use("12mm"), "hit");
  EXPECT_EQ(use("11mm"), "miss");
  const Outcome text = vpsbake(folder_, "cache prune --max-size 1B", "cache");
  EXPECT_TRUE(text.out.starts_with("cache: removed 3 of 3 entries, ")) << text.out;
}

TEST_F(CliCacheCommand, NamesDamageAndRemovesItWhenAsked) {
  EXPECT_EQ(run("verify")["entries"], 3);
  const fs::path damaged = files_of_entries(folder_ / "cache").back();
  std::string bytes = read_file(damaged);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write_file(damaged, bytes);
  const Json found = run("verify", 5);
  ASSERT_EQ(found["damaged"].size(), 1U);
  EXPECT_EQ(folder_ / found["damaged"][0]["file"], damaged);
  expect_refusal(folder_, "cache verify --cache cache", 5, "; remove it with --remove");
  EXPECT_EQ(run("verify --remove", 5)["damaged"][0]["removed"], true);
  EXPECT_EQ(run("verify")["entries"], 2);
}

TEST_F(CliCacheCommand, ABakeKeepsTheFolderBelowItsLimit) {
  const auto bytes = run("stats")["bytes"].get<std::int64_t>();
  const std::string limit = std::to_string(bytes + 1000) + "B";
  const std::string cube = sample("cube") + " -o a.vps.hdf --cache cache";
  EXPECT_EQ(vpsbake(folder_, cube + " --voxel 9mm").code, 0);
  EXPECT_EQ(run("stats")["entries"], 4);
  EXPECT_EQ(vpsbake(folder_, cube + " --voxel 13mm --cache-size " + limit).code, 0);
  EXPECT_LE(run("stats")["bytes"], bytes + 1000);
  EXPECT_EQ(use("13mm"), "hit");
  // The limit from the environment, as used for a whole batch.
  ASSERT_EQ(::setenv("VPSBAKE_CACHE_SIZE", "1B", 1), 0);
  EXPECT_EQ(vpsbake(folder_, cube + " --voxel 14mm").code, 0);
  ASSERT_EQ(::setenv("VPSBAKE_CACHE_SIZE", "20", 1), 0);
  expect_refusal(folder_, cube + " --voxel 15mm", 1, "VPSBAKE_CACHE_SIZE: a size needs a unit");
  ASSERT_EQ(::unsetenv("VPSBAKE_CACHE_SIZE"), 0);
  EXPECT_EQ(run("stats")["entries"], 0);
}

TEST(CliCacheRefusals, SayWhatToGive) {
  const TemporaryFolder folder;
  for (const char* const action : {"stats", "verify", "prune --max-size 1GB"}) {
    const Outcome none = vpsbake(folder, std::string("cache ") + action + " --cache .");
    EXPECT_EQ(none.code, 0);
    EXPECT_EQ(none.err, "vpsbake: note: .: it holds no assets; check that it is the folder of a cache\n");
  }
  expect_refusal(folder, "cache", 1, "subcommand is required");
  expect_refusal(folder, "cache stats", 1, "--cache is required");
  expect_refusal(folder, "cache stats --cache absent", 2,
                 "absent: the folder does not exist; give the folder of a cache");
  expect_refusal(folder, "cache stats --cache /dev/null", 2, "/dev/null: this is not a folder; give the folder");
  expect_refusal(folder, "cache prune --cache .", 1, "--max-size is required");
  expect_refusal(folder, "cache prune --cache . --max-size 20", 1, "a size needs a unit");
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/store/cache_upkeep.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <set>

#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

using namespace bake;
namespace {

namespace fs = std::filesystem;
using std::chrono::hours;
using std::chrono::minutes;

// Counting and pruning read only names, sizes and times, so that the files may hold anything.
class Folder : public testing::Test {
 protected:
  [[nodiscard]] fs::path add(const std::string& name, std::size_t bytes, minutes age) const {
    const fs::path file = folder_ / name;
    fs::create_directories(file.parent_path());
    write_file(file, std::string(bytes, 'x'));
    fs::last_write_time(file, now_ - age);
    return file;
  }
  // An entry of 1000 bytes.
  [[nodiscard]] fs::path add_entry(const std::string& folder, char digit, minutes age) const {
    const std::string name = folder + "/" + folder + std::string(30, digit);
    static_cast<void>(add(name + ".json", 100, hours(1000)));  // only the asset is marked as used
    return add(name + ".vps.hdf", 900, age);
  }
  [[nodiscard]] PrunedCache prune(std::uint64_t max_bytes, PruneMode mode = PruneMode::remove) const {
    return prune_cache(folder_.path(), max_bytes, mode);
  }

  const TemporaryFolder folder_;
  const fs::file_time_type now_ = fs::file_time_type::clock::now();
};

TEST_F(Folder, IsCountedByEntriesAndLeftovers) {
  EXPECT_EQ(cache_usage(folder_.path()).entries, 0U);
  EXPECT_EQ(cache_usage(folder_.path()).oldest_use, 0);
  static_cast<void>(add_entry("00", '0', hours(5)));
  static_cast<void>(add_entry("ff", 'a', hours(2)));
  static_cast<void>(add_entry("ff", 'b', hours(3)));
  static_cast<void>(add("0a/.vps.12.0", 7, hours(0)));
  static_cast<void>(add("0a/0a" + std::string(30, '1') + ".json", 5, hours(0)));
  const CacheUsage usage = cache_usage(folder_.path());
  EXPECT_EQ(usage.entries, 3U);
  EXPECT_EQ(usage.bytes, 3000U);
  EXPECT_EQ(usage.newest_use - usage.oldest_use, 3 * 3600);
  EXPECT_NEAR(double(std::time(nullptr) - usage.newest_use), 2 * 3600, 60);
  EXPECT_EQ(usage.leftovers, 2U);
  EXPECT_EQ(usage.leftover_bytes, 12U);
  EXPECT_THROW(static_cast<void>(cache_usage(folder_ / "absent")), fs::filesystem_error);
}

TEST_F(Folder, LosesWhatWasUsedLeastRecentlyUntilTheRestFits) {
  const fs::path oldest = add_entry("77", '1', hours(30)), newest = add_entry("00", '2', hours(1)),
                 second = add_entry("ff", '3', hours(20)), third = add_entry("77", '4', hours(10));
  const PrunedCache enough = prune(4000);
  EXPECT_EQ(enough.removed, 0U);
  EXPECT_EQ(enough.entries, 4U);
  const PrunedCache planned = prune(2500, PruneMode::dry_run);
  EXPECT_EQ(planned.removed, 2U);
  EXPECT_EQ(planned.removed_bytes, 2000U);
  EXPECT_EQ(planned.bytes, 2000U);
  EXPECT_EQ(cache_usage(folder_.path()).entries, 4U) << "nothing is removed in a dry run";
  const PrunedCache pruned = prune(2500);
  EXPECT_EQ(pruned.removed, 2U);
  EXPECT_EQ(pruned.entries, 2U);
  EXPECT_EQ(pruned.failed, 0U);
  EXPECT_FALSE(fs::exists(oldest) || fs::exists(second));
  EXPECT_TRUE(fs::exists(newest) && fs::exists(third));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "ff"), {}), 0) << "reports go as well";
  EXPECT_EQ(prune(0).entries, 0U);
}

TEST_F(Folder, LosesLeftoversOfMoreThanAnHour) {
  const std::string key = "0a" + std::string(30, '1');
  const fs::path old_temporary = add("0a/.vps.12.0", 7, minutes(61)), at_work = add("0a/.vps.12.1", 7, minutes(59)),
                 old_report = add("0a/" + key + ".json", 5, minutes(61)),
                 new_report = add("0b/0b" + std::string(30, '1') + ".json", 5, minutes(59));
  const PrunedCache pruned = prune(1000);
  EXPECT_EQ(pruned.leftovers, 2U);
  EXPECT_EQ(pruned.leftover_bytes, 12U);
  EXPECT_FALSE(fs::exists(old_temporary) || fs::exists(old_report));
  EXPECT_TRUE(fs::exists(at_work) && fs::exists(new_report));
}

TEST_F(Folder, KeepsWhatIsNotOfTheCache) {
  const std::string digits(30, '1');
  std::vector<fs::path> others;
  for (const std::string& name :
       {std::string("hacd_0123456789abcdef.txt"), std::string("CACHEDIR.TAG"), "77" + digits + ".vps.hdf",
        "77/78" + digits + ".vps.hdf", "77/77" + digits + ".vps.hdf.bak", "77/77" + digits + "1.vps.hdf",
        "77/77" + std::string(30, 'A') + ".vps.hdf", std::string("77/notes.json"), "other/77" + digits + ".vps.hdf"})
    others.push_back(add(name, 10, hours(100)));
  fs::create_directories(folder_ / ("77/77" + std::string(30, '5') + ".vps.hdf"));
  static_cast<void>(add_entry("77", '2', hours(1)));
  EXPECT_EQ(cache_usage(folder_.path()).entries, 1U);
  EXPECT_EQ(prune(0).removed, 1U);
  for (const fs::path& other : others) EXPECT_TRUE(fs::exists(other)) << other;
}

// Assets that differ only in their records.
class Stored : public testing::Test {
 protected:
  static const BakedAsset& plain() {
    static const BakedAsset baked = [] {
      BakeOptions options;
      options.voxel_size = 0.01;
      return bake::bake(make_box({0.05, 0.04, 0.03}), options);
    }();
    return baked;
  }
  [[nodiscard]] CacheKey store(const AssetCache& cache, int number) const {
    BakedAsset baked = plain();
    const BakeRecord record{"number " + std::to_string(number) + "\n"};
    add_record(record, baked);
    EXPECT_EQ(cache.store(cache_key(record), asset_bytes(baked.info, baked.sections), {}), "");
    return cache_key(record);
  }
  [[nodiscard]] static bool opens(const AssetCache& cache, const CacheKey& key) {
    Asset asset;
    BakeReport report;
    return cache.open(key, asset, report);
  }

  const TemporaryFolder folder_;
};

TEST_F(Stored, EntriesStayBelowTheLimitAndThoseInUseStay) {
  const AssetCache unlimited(folder_ / "one");
  const CacheKey first = store(unlimited, 0);
  const std::uint64_t one = cache_usage(folder_ / "one").bytes;
  const AssetCache cache(folder_ / "cache", 6 * one);
  EXPECT_EQ(store(cache, 0), first);
  CacheKey last;
  for (int number = 1; number < 20; ++number) {
    last = store(cache, number);
    EXPECT_LE(cache_usage(folder_ / "cache").bytes, 6 * one);
    EXPECT_TRUE(opens(cache, first)) << "used after each store, after " << number;
  }
  EXPECT_TRUE(opens(cache, last));
  EXPECT_EQ(cache_usage(folder_ / "cache").entries, 5U);
  EXPECT_EQ(cache_usage(folder_ / "cache").leftovers, 0U);
}

TEST_F(Stored, WhatIsRemovedStaysWholeForItsReaders) {
  const AssetCache cache(folder_ / "cache");
  const CacheKey key = store(cache, 0);
  Asset asset;
  BakeReport report;
  ASSERT_TRUE(cache.open(key, asset, report));
  EXPECT_EQ(prune_cache(folder_ / "cache", 0).removed, 1U);
  EXPECT_EQ(asset.verify(), Status::ok);
  EXPECT_FALSE(opens(cache, key));
}

TEST_F(Stored, DamageIsNamedAndRemovedWhenAsked) {
  const AssetCache cache(folder_ / "cache");
  std::vector<fs::path> files;
  for (int number = 0; number < 5; ++number) {
    const CacheKey key = store(cache, number);
    files.push_back(folder_ / "cache" / key.digits.substr(0, 2) / (key.digits + ".vps.hdf"));
  }
  EXPECT_TRUE(verify_cache(folder_ / "cache").damaged.empty());
  const auto report_of = [](const fs::path& asset) {
    return asset.parent_path() / (asset.filename().string().substr(0, 32) + ".json");
  };
  std::string flipped = read_file(files[0]);
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  write_file(files[0], flipped);
  fs::remove(report_of(files[1]));
  write_file(report_of(files[2]), read_file(report_of(files[2])) + " ");
  std::string later = read_file(files[3]);
  later[8] = static_cast<char>(kFormatMajor + 1);  // the major version, after the magic
  write_file(files[3], later);
  const CheckedCache checked = verify_cache(folder_ / "cache");
  EXPECT_EQ(checked.entries, 5U);
  EXPECT_EQ(checked.other_versions, 1U);
  EXPECT_EQ(checked.damaged.size(), 3U);
  const CheckedCache removed = verify_cache(folder_ / "cache", VerifyMode::remove_damaged);
  std::set<fs::path> names;
  for (const DamagedEntry& entry : removed.damaged) {
    EXPECT_TRUE(entry.removed);
    EXPECT_NE(entry.reason, "");
    names.insert(entry.file);
  }
  EXPECT_EQ(names, std::set<fs::path>(files.begin(), files.begin() + 3));
  EXPECT_TRUE(verify_cache(folder_ / "cache").damaged.empty());
  EXPECT_EQ(verify_cache(folder_ / "cache").entries, 2U);
}

TEST_F(Stored, ANewFolderIsTaggedAndOneThatWasThereIsNot) {
  static_cast<void>(store(AssetCache(folder_ / "cache"), 0));
  EXPECT_TRUE(read_file(folder_ / "cache/CACHEDIR.TAG").starts_with("Signature: 8a477f597d28d172789f06886806bc55\n"));
  fs::create_directory(folder_ / "work");
  static_cast<void>(store(AssetCache(folder_ / "work"), 0));
  EXPECT_FALSE(fs::exists(folder_ / "work/CACHEDIR.TAG"));
}

TEST_F(Stored, ATeamMayShareWhatItsMaskAllows) {
  const ::mode_t before = ::umask(002);
  static_cast<void>(store(AssetCache(folder_ / "cache"), 0));
  ::umask(before);
  for (const auto& entry : fs::recursive_directory_iterator(folder_ / "cache"))
    EXPECT_EQ(static_cast<int>(entry.status().permissions()), entry.is_directory() ? 0775 : 0664) << entry.path();
}

}  // namespace
}  // namespace vps::test

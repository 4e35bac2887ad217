// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/store/cache.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>
#include <functional>
#include <set>
#include <thread>

#include "bake/store/cache_upkeep.h"
#include "tests/support/comma_locale.h"
#include "tests/support/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

using namespace bake;
namespace {

namespace fs = std::filesystem;

BakeSettings coarse_settings() {
  BakeSettings settings;
  settings.options.voxel_size = 0.01;
  return settings;
}

const TriangleMesh& box() {
  static const TriangleMesh mesh = make_box({0.05, 0.04, 0.03});
  return mesh;
}

std::string digits(const std::optional<BakeRecord>& record) {
  return record ? cache_key(*record).digits : "none";
}

TEST(CacheKey, EverySettingThatChangesBytesChangesTheKey) {
  using Change = std::function<void(BakeSettings&)>;
  const Change changes[] = {
      [](BakeSettings& s) { s.import.unit = 0.001; },
      [](BakeSettings& s) { s.max_error = 1e-4; },
      [](BakeSettings& s) { s.options.voxel_size = std::nextafter(s.options.voxel_size, 1); },
      [](BakeSettings& s) { s.options.resolution = 7; },
      [](BakeSettings& s) { s.options.layers = true; },
      [](BakeSettings& s) { s.options.scaled = false; },
      [](BakeSettings& s) { s.options.real = true; },
      [](BakeSettings& s) { s.options.voxelmap = false; },
      [](BakeSettings& s) { s.options.pointshell = false; },
      [](BakeSettings& s) { s.options.precision = 4; },
      [](BakeSettings& s) { s.options.branching = 8; },
      [](BakeSettings& s) { s.options.band_inside = 3; },
      [](BakeSettings& s) { s.options.band_outside = 3; },
      [](BakeSettings& s) { s.options.field_error = 0.2; },
      [](BakeSettings& s) { s.options.alpha = 2; },
      [](BakeSettings& s) { s.options.repair = Repair::none; },
      [](BakeSettings& s) { s.options.repair = Repair::wrap; },
      [](BakeSettings& s) { s.options.sheet_thickness = 0.002; },
  };
  std::set<std::string> keys = {cache_key(bake_record(box(), coarse_settings())).digits};
  for (const Change& change : changes) {
    BakeSettings settings = coarse_settings();
    change(settings);
    keys.insert(cache_key(bake_record(box(), settings)).digits);
  }
  EXPECT_EQ(keys.size(), 1 + std::size(changes));
}

TEST(CacheKey, LimitsAndCallsDoNotChangeTheKey) {
  BakeSettings settings = coarse_settings();
  settings.import.memory_limit_bytes = 1;
  settings.import.timeout = 1;
  settings.options.memory_limit_bytes = 1;
  settings.options.progress = [](const char*, double) {};
  settings.options.planned = [](const BakePlan&) {};
  EXPECT_EQ(cache_key(bake_record(box(), settings)), cache_key(bake_record(box(), coarse_settings())));
}

TEST(CacheKey, ALocaleWithADecimalCommaDoesNotChangeIt) {
  const std::string text = bake_record(box(), coarse_settings()).text;
  EXPECT_NE(text.find(fmt::format("\nvoxel_size {:a}\n", coarse_settings().options.voxel_size)), text.npos) << text;
  const CommaLocale comma;
  if (!comma.is_set()) GTEST_SKIP() << "needs Debian's locales";
  EXPECT_EQ(bake_record(box(), coarse_settings()).text, text);
  EXPECT_EQ(exact_number("0x1.47ae147ae147bp-7"), 0.01);
}

TEST(CacheKey, NumbersOfARecordAreReadBack) {
  EXPECT_EQ(exact_number("-0x1.8p+1"), -3);
  EXPECT_EQ(exact_number("0x0p+0"), 0);
  EXPECT_EQ(exact_number("automatic"), std::nullopt);
}

TEST(CacheKey, TheProgramAndTheFormatAreAmongTheSettings) {
  const std::string text = describe_settings({});
  EXPECT_TRUE(text.starts_with("program vpsbake ")) << text;
  EXPECT_NE(text.find(", sources "), std::string::npos) << text;
  EXPECT_NE(text.find("\nformat " + std::to_string(kFormatMajor) + "." + std::to_string(kFormatMinor) + "\n"),
            std::string::npos)
      << text;
}

TEST(CacheKey, AFileIsItsBytesAndItsExtension) {
  const TemporaryFolder folder;
  const BakeSettings settings = coarse_settings();
  write_file(folder / "a.off", "OFF\n1 2 3");
  const auto record = bake_record(folder / "a.off", settings);
  ASSERT_TRUE(record);
  const std::string key = digits(record);
  EXPECT_EQ(key.size(), 32U);
  EXPECT_EQ(key.find_first_not_of("0123456789abcdef"), std::string::npos);
  fs::last_write_time(folder / "a.off", fs::file_time_type() + std::chrono::hours(1));
  EXPECT_EQ(bake_record(folder / "a.off", settings), record);
  fs::create_directory(folder / "b");
  write_file(folder / "b/other.OFF", "OFF\n1 2 3");
  EXPECT_EQ(bake_record(folder / "b/other.OFF", settings), record);
  std::set<std::string> keys = {key};
  write_file(folder / "a.obj", "OFF\n1 2 3");
  keys.insert(digits(bake_record(folder / "a.obj", settings)));
  for (const char* text : {"OFF\n1 2 4", "OFF\n1 2 3\n", "OFF\n1 2", ""}) {
    write_file(folder / "a.off", text);
    keys.insert(digits(bake_record(folder / "a.off", settings)));
  }
  EXPECT_EQ(keys.size(), 6U);
}

TEST(CacheKey, WhatIsNoReadableFileHasNone) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "pipe.obj").c_str(), 0600), 0);
  for (const char* name : {"absent.obj", "", "pipe.obj"})
    EXPECT_FALSE(bake_record(folder / name, coarse_settings())) << name;
}

TEST(CacheKey, TheBuffersOfAGltfFileCountAndItsTexturesDoNot) {
  const TemporaryFolder folder;
  const auto key_of = [&](const char* name) { return bake_record(folder / name, coarse_settings()); };
  const std::string text =
      R"({"images": [{"uri": "skin.png"}], "buffers": [{"uri": "a b.bin", "byteLength": 3}, {"uri": "data:,xyz"},)"
      R"( {"byteLength": 1, "uri": "c.bin"}], "scenes": [{"uri": "nothing"}]})";
  write_file(folder / "mesh.gltf", text);
  std::string glb = "glTF" + std::string(16, '\0') + text + "rest";
  const auto size = static_cast<std::uint32_t>(text.size());
  std::memcpy(glb.data() + 12, &size, sizeof size);
  write_file(folder / "mesh.glb", glb);
  write_file(folder / "a b.bin", "abc");
  const auto without = key_of("mesh.gltf");
  EXPECT_TRUE(without) << "nothing may use it";
  write_file(folder / "c.bin", "c");
  EXPECT_NE(key_of("mesh.gltf"), without);
  for (const char* mesh : {"mesh.gltf", "mesh.glb"}) {
    const auto key = key_of(mesh);
    ASSERT_TRUE(key) << mesh;
    write_file(folder / "skin.png", "red");
    EXPECT_EQ(key_of(mesh), key);
    write_file(folder / "c.bin", "d");
    EXPECT_NE(key_of(mesh), key);
    write_file(folder / "c.bin", "c");
    EXPECT_EQ(key_of(mesh), key);
    write_file(folder / "a b.bin", "abd");
    EXPECT_NE(key_of(mesh), key);
    write_file(folder / "a b.bin", "abc");
  }
  write_file(folder / "mesh.gltf", text.substr(1));
  EXPECT_FALSE(key_of("mesh.gltf")) << "not JSON";
}

TEST(CacheKey, TheOlderFormOfGltfIsUnderstoodToo) {
  const TemporaryFolder folder;
  write_file(folder / "a.gltf", R"({"buffers": {"first": {"uri": "a.bin"}}, "images": {"i": {"uri": "i.png"}}})");
  const auto without = bake_record(folder / "a.gltf", coarse_settings());
  write_file(folder / "a.bin", "a");
  const auto record = bake_record(folder / "a.gltf", coarse_settings());
  EXPECT_TRUE(record);
  EXPECT_NE(record, without);
}

TEST(CacheKey, AMeshInMemoryIsItsVerticesAndTriangles) {
  std::set<std::string> keys;
  const auto add = [&](const TriangleMesh& mesh) {
    keys.insert(cache_key(bake_record(mesh, coarse_settings())).digits);
  };
  add(box());
  add(TriangleMesh(box()));
  EXPECT_EQ(keys.size(), 1U);
  TriangleMesh moved = box();
  moved.vertices[3][1] = std::nextafter(moved.vertices[3][1], 1);
  add(moved);
  TriangleMesh turned = box();
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  add(turned);
  add({});
  EXPECT_EQ(keys.size(), 4U);
}

TEST(BakeRecord, AnAssetSaysWhatItWasBakedFrom) {
  const TemporaryFolder folder;
  const BakeSettings settings = coarse_settings();
  const BakeRecord record = bake_record(box(), settings);
  EXPECT_TRUE(record.text.starts_with(describe_settings(settings)));
  BakedAsset baked = bake::bake(box(), settings.options);
  write_asset(folder / "without.vps.hdf", baked.info, baked.sections);
  add_record(record, baked);
  write_asset(folder / "with.vps.hdf", baked.info, baked.sections);
  Asset with, without;
  ASSERT_EQ(Asset::open((folder / "with.vps.hdf").c_str(), with), Status::ok);
  ASSERT_EQ(Asset::open((folder / "without.vps.hdf").c_str(), without), Status::ok);
  EXPECT_EQ(with.verify(), Status::ok);
  EXPECT_EQ(record_of(with), record);
  EXPECT_EQ(record_of(without), BakeRecord());
}

TEST(BakeRecord, TheFilesOfAMeshAreItsBuffersToo) {
  const TemporaryFolder folder;
  write_file(folder / "mesh.gltf",
             R"({"images": [{"uri": "skin.png"}], "buffers": [{"uri": "a.bin"}, {"uri": "absent"}]})");
  EXPECT_EQ(mesh_files(folder / "mesh.gltf"), (std::vector{folder / "mesh.gltf", folder / "a.bin", folder / "absent"}));
  EXPECT_EQ(mesh_files(folder / "mesh.obj"), std::vector{folder / "mesh.obj"});
  write_file(folder / "mesh.gltf", R"({"buffers": [{"uri": "a%20b.bin"}, {"uri": "c%C3%A9.bin"}, {"uri": "d%20"}]})");
  for (const char* name : {"a b.bin", "a%20b.bin", "c\xC3\xA9.bin"}) write_file(folder / name, "b");
  EXPECT_EQ(mesh_files(folder / "mesh.gltf"),
            (std::vector{folder / "mesh.gltf", folder / "a%20b.bin", folder / "c\xC3\xA9.bin", folder / "d%20"}));
}

TEST(MeshState, IsAnotherOnceAFileWasWrittenAgain) {
  const TemporaryFolder folder;
  const auto state = [&] { return mesh_state(folder / "mesh.gltf", coarse_settings()); };
  write_file(folder / "mesh.gltf", R"({"buffers": [{"uri": "a.bin"}]})");
  write_file(folder / "a.bin", "a");
  const MeshState first = state();
  EXPECT_TRUE(first.record);
  EXPECT_EQ(state(), first);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // file times may be this coarse
  write_file(folder / "a.bin", "a");
  EXPECT_NE(state(), first);
  EXPECT_EQ(state().record, first.record);
  EXPECT_FALSE(mesh_state(folder / "absent.obj", coarse_settings()).record);
}

// A cache that holds the asset of the box.
class Entry : public testing::Test {
 protected:
  void SetUp() override {
    const BakeSettings settings = coarse_settings();
    baked_ = bake::bake(box(), settings.options);
    add_record(bake_record(box(), settings), baked_);
    bytes_ = asset_bytes(baked_.info, baked_.sections);
    report_ = {plan_bake(box(), settings.options), Repair::stitch, 0.25, {"a note", "another \"note\"\n"}};
    ASSERT_EQ(cache_.store(key_, bytes_, report_), "");
  }
  [[nodiscard]] bool opens() const {
    Asset asset;
    BakeReport report;
    const bool opened = cache_.open(key_, asset, report);
    EXPECT_EQ(opened, asset.is_open());
    return opened;
  }

  const TemporaryFolder folder_;
  const AssetCache cache_{folder_ / "a/b"};  // created with the first entry
  const CacheKey key_ = cache_key(bake_record(box(), coarse_settings()));
  const fs::path asset_file_ = folder_ / "a/b" / key_.digits.substr(0, 2) / (key_.digits + ".vps.hdf");
  const fs::path report_file_ = folder_ / "a/b" / key_.digits.substr(0, 2) / (key_.digits + ".json");
  BakedAsset baked_;
  std::vector<std::byte> bytes_;  // of its file
  BakeReport report_;
};

TEST_F(Entry, ComesBackByteForByteWithItsReport) {
  Asset asset;
  BakeReport report;
  ASSERT_TRUE(cache_.open(key_, asset, report));
  write_asset(folder_ / "fresh.vps.hdf", baked_.info, baked_.sections);
  const std::string fresh = read_file(folder_ / "fresh.vps.hdf");
  ASSERT_EQ(asset.bytes().size(), fresh.size());
  EXPECT_EQ(std::memcmp(asset.bytes().data(), fresh.data(), fresh.size()), 0);
  EXPECT_EQ(read_file(asset_file_), fresh);
  EXPECT_EQ(report.plan.dims, report_.plan.dims);
  EXPECT_EQ(report.plan.voxel_size, report_.plan.voxel_size);
  EXPECT_EQ(report.plan.predicted_memory_bytes, report_.plan.predicted_memory_bytes);
  EXPECT_EQ(report.repair, report_.repair);
  EXPECT_EQ(report.filled_share, report_.filled_share);
  EXPECT_EQ(report.notes, report_.notes);
  EXPECT_FALSE(cache_.open({std::string(32, '0')}, asset, report));
  EXPECT_TRUE(asset.is_open()) << "what was open stays";
}

TEST_F(Entry, DamagedOrIncompleteIsNotUsedAndIsReplaced) {
  for (const fs::path& file : {asset_file_, report_file_}) {
    const std::string whole = read_file(file);
    const auto expect_refused = [&](const std::string& bytes, const std::string& how) {
      write_file(file, bytes);
      EXPECT_FALSE(opens()) << file << " " << how;
    };
    for (std::size_t i = 0; i < 40; ++i) {
      const std::size_t at = (whole.size() - 1) * i / 39;
      std::string flipped = whole;
      flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
      expect_refused(flipped, "flipped at " + std::to_string(at));
      expect_refused(whole.substr(0, at), "cut at " + std::to_string(at));
    }
    expect_refused(whole + '\0', "with a byte more");
    fs::remove(file);
    EXPECT_FALSE(opens());
    EXPECT_EQ(cache_.store(key_, bytes_, report_), "");
    EXPECT_EQ(read_file(file), whole);
    EXPECT_TRUE(opens());
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(asset_file_.parent_path()), {}), 2);
}

TEST_F(Entry, UnderTheNameOfAnotherIsNotUsed) {
  const CacheKey other = cache_key(bake_record(make_box({1, 1, 1}), coarse_settings()));
  const fs::path folder = folder_ / "a/b" / other.digits.substr(0, 2);
  fs::create_directories(folder);
  fs::copy_file(asset_file_, folder / (other.digits + ".vps.hdf"));
  fs::copy_file(report_file_, folder / (other.digits + ".json"));
  Asset asset;
  BakeReport report;
  EXPECT_FALSE(cache_.open(other, asset, report));
  const CheckedCache checked = verify_cache(folder_ / "a/b");
  EXPECT_EQ(checked.entries, 2U);
  ASSERT_EQ(checked.damaged.size(), 1U);
  EXPECT_EQ(checked.damaged[0].file, folder / (other.digits + ".vps.hdf"));
  EXPECT_EQ(checked.damaged[0].reason, "its record is not the one of its name");
}

TEST_F(Entry, WithoutAKeyIsNotStored) {
  const std::string why = cache_.store(std::nullopt, bytes_, report_);
  EXPECT_NE(why.find("files that cannot be read"), std::string::npos) << why;
}

TEST_F(Entry, ThatCannotBeWrittenSaysWhy) {
  write_file(folder_ / "file", "");
  EXPECT_NE(AssetCache(folder_ / "file").store(key_, bytes_, report_), "");
  EXPECT_NE(AssetCache(folder_ / "file/below").store(key_, bytes_, report_), "");
  const TemporaryFolder other;
  fs::create_directories(other / key_.digits.substr(0, 2) / (key_.digits + ".vps.hdf"));
  EXPECT_EQ(AssetCache(other.path()).store(key_, bytes_, report_), "the output is a folder");
  EXPECT_FALSE(AssetCache(other.path()).open(key_, *std::make_unique<Asset>(), report_));
}

}  // namespace
}  // namespace vps::test

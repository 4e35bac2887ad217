// SPDX-License-Identifier: GPL-3.0-or-later
// The cache of the program: hits, misses, and problems with its folder.
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "tests/cli/program.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

// The cache's entry in the program's report; the run must succeed.
std::string use_of_cache(const TemporaryFolder& folder, const std::string& arguments, const std::string& cache = "") {
  const Outcome run = vpsbake(folder, arguments + " --json", cache);
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  return run.code == 0 ? nlohmann::json::parse(run.out)["cache"].get<std::string>() : "";
}

TEST(CliCache, TheSecondBakeIsAHitWithTheSameBytesAndTheSameReport) {
  const TemporaryFolder folder;
  const std::string plate = sample("thin_plate") + " --voxel 1mm --cache deep/cache";  // has a note: thin walls
  const auto report = [&](const std::string& output) {
    const Outcome run = vpsbake(folder, plate + " --json -o " + output);
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_EQ(run.err, "");
    return nlohmann::ordered_json::parse(run.out);
  };
  EXPECT_EQ(use_of_cache(folder, sample("thin_plate") + " --voxel 1mm -o fresh.vps.hdf"), "off");
  auto first = report("first.vps.hdf");
  auto second = report("second.vps.hdf");
  EXPECT_EQ(first["cache"], "miss");
  EXPECT_EQ(second["cache"], "hit");
  const std::string fresh = read_file(folder / "fresh.vps.hdf");
  EXPECT_EQ(read_file(folder / "first.vps.hdf"), fresh);
  EXPECT_EQ(read_file(folder / "second.vps.hdf"), fresh);
  EXPECT_FALSE(second["seconds"].contains("voxelize"));
  EXPECT_EQ(second["notes"].size(), 1U);
  for (auto* j : {&first, &second})
    for (const char* key : {"cache", "output", "seconds", "critical_path"}) j->erase(key);
  EXPECT_EQ(second, first);

  const Outcome hit = vpsbake(folder, plate + " -o third.vps.hdf");
  EXPECT_TRUE(hit.out.ends_with(" s (cache: hit)\n")) << hit.out;
  EXPECT_NE(hit.out.find("note: "), std::string::npos) << hit.out;
  // The output is a copy: changing it does not change the cache.
  write_file(folder / "third.vps.hdf", "changed");
  fs::remove(folder / "third.vps.hdf");
  EXPECT_EQ(use_of_cache(folder, plate + " -o third.vps.hdf"), "hit");
}

TEST(CliCache, BytesAndSettingsMakeAMissNamesAndTimesDoNot) {
  const TemporaryFolder folder;
  fs::copy_file(sample("cube"), folder / "cube.obj");
  const auto use = [&](const std::string& arguments) {
    return use_of_cache(folder, arguments + " -o a.vps.hdf --cache cache");
  };
  EXPECT_EQ(use("cube.obj --voxel 10mm"), "miss");
  fs::last_write_time(folder / "cube.obj", fs::file_time_type() + std::chrono::hours(1));
  EXPECT_EQ(use("cube.obj --voxel 10mm --memory 1GB --import-timeout 60s"), "hit");
  fs::rename(folder / "cube.obj", folder / "other.obj");
  EXPECT_EQ(use("other.obj --voxel 10mm"), "hit");
  EXPECT_EQ(use("other.obj --voxel 0.01m"), "hit");
  for (const char* changed :
       {"--voxel 4mm", "--resolution 20", "--max-error 1mm", "--voxel 10mm --scale 2", "--voxel 10mm --fields layers",
        "--voxel 10mm --parts voxelmap", "--voxel 10mm --repair none", "--voxel 10mm --open-surface thicken=2mm"}) {
    EXPECT_EQ(use(std::string("other.obj ") + changed), "miss") << changed;
    EXPECT_EQ(use(std::string("other.obj ") + changed), "hit") << changed;
  }
  write_file(folder / "other.obj", read_file(folder / "other.obj") + "\n");
  EXPECT_EQ(use("other.obj --voxel 10mm"), "miss");
}

TEST(CliCache, TheOptionWinsOverTheEnvironment) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " --voxel 10mm -o a.vps.hdf";
  EXPECT_EQ(use_of_cache(folder, cube, "one"), "miss");
  EXPECT_EQ(use_of_cache(folder, cube, "one"), "hit");
  EXPECT_EQ(use_of_cache(folder, cube + " --cache two", "one"), "miss");
  EXPECT_EQ(use_of_cache(folder, cube + " --no-cache", "one"), "off");
  EXPECT_EQ(use_of_cache(folder, cube), "off");
  EXPECT_EQ(vpsbake(folder, cube, "").out.find("cache"), std::string::npos);
  EXPECT_EQ(vpsbake(folder, "info a.vps.hdf", "one").code, 0);
  EXPECT_EQ(vpsbake(folder, "check " + sample("cube"), "one").code, 0);
  expect_refusal(folder, cube + " --cache ''", 1, "is empty");
  expect_refusal(folder, cube + " --cache two --no-cache", 1, "excludes");
}

TEST(CliCache, ADamagedEntryIsBakedAgainAndReplaced) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " --voxel 10mm -o a.vps.hdf --cache cache";
  ASSERT_EQ(use_of_cache(folder, cube), "miss");
  const std::string whole = read_file(folder / "a.vps.hdf");
  for (const fs::path& file : files_of_entries(folder / "cache")) {
    const std::string bytes = read_file(file);
    std::string flipped = bytes;
    flipped[bytes.size() * 3 / 4] = static_cast<char>(flipped[bytes.size() * 3 / 4] ^ 1);
    for (const std::string& damaged : {flipped, bytes.substr(0, bytes.size() / 2), std::string()}) {
      write_file(file, damaged);
      EXPECT_EQ(use_of_cache(folder, cube), "miss") << file;
      EXPECT_EQ(read_file(folder / "a.vps.hdf"), whole);
      EXPECT_EQ(read_file(file), bytes);
    }
  }
}

// Others may write to a shared cache, too.
TEST(CliCache, ALinkInItLeadsToNoOtherFile) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " --voxel 10mm -o a.vps.hdf --cache cache";
  ASSERT_EQ(use_of_cache(folder, cube), "miss");
  for (const fs::path& file : files_of_entries(folder / "cache")) {
    const std::string bytes = read_file(file);
    for (const char* const target : {"precious", "nowhere"}) {
      write_file(folder / "precious", "precious");
      fs::remove(file);
      fs::create_symlink(folder / target, file);
      EXPECT_EQ(use_of_cache(folder, cube), "miss") << file;
      EXPECT_EQ(read_file(folder / "precious"), "precious");
      EXPECT_FALSE(fs::exists(folder / "nowhere"));
      EXPECT_FALSE(fs::is_symlink(file));
      EXPECT_EQ(read_file(file), bytes);
    }
  }
}

TEST(CliCache, AFolderThatCannotBeUsedCostsOneLine) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " --voxel 10mm";
  ASSERT_EQ(vpsbake(folder, cube + " -o fresh.vps.hdf").code, 0);
  write_file(folder / "file", "");
  fs::create_directory(folder / "locked");
  fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  for (const char* cache : {"file", "file/below", "/proc/none", "locked"}) {
    if (cache == std::string("locked") && ::geteuid() == 0) continue;  // nothing is locked for root
    const Outcome run = vpsbake(folder, cube + " -o a.vps.hdf --cache " + cache);
    EXPECT_EQ(run.code, 0);
    EXPECT_TRUE(run.err.starts_with(std::string("vpsbake: warning: ") + cache + ": ")) << run.err;
    EXPECT_TRUE(run.err.ends_with("; the asset is not kept there\n")) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_EQ(read_file(folder / "a.vps.hdf"), read_file(folder / "fresh.vps.hdf"));
  }
  fs::permissions(folder / "locked", fs::perms::owner_all);
}

TEST(CliCache, AnEntryThatCannotBeWrittenCostsOneLine) {
  const TemporaryFolder folder;
  const std::string cube = sample("cube") + " --voxel 10mm -o a.vps.hdf --cache cache";
  ASSERT_EQ(use_of_cache(folder, cube), "miss");
  const std::string whole = read_file(folder / "a.vps.hdf");
  for (const fs::path& file : files_of_entries(folder / "cache")) {
    fs::remove(file);
    fs::create_directory(file);
  }
  const Outcome run = vpsbake(folder, cube);
  EXPECT_EQ(run.code, 0);
  EXPECT_TRUE(run.err.starts_with("vpsbake: warning: cache: ")) << run.err;
  EXPECT_EQ(read_file(folder / "a.vps.hdf"), whole);
}

TEST(CliCache, AHitIsNotWrittenOverOtherFiles) {
  const TemporaryFolder folder;
  ASSERT_EQ(use_of_cache(folder, sample("cube") + " --voxel 10mm -o a.vps.hdf --cache cache"), "miss");
  write_file(folder / "notes.txt", "mine");
  const std::string again = sample("cube") + " --voxel 10mm --cache cache -o ";
  expect_refusal(folder, again + "notes.txt", 2, "exists and is not an asset");
  expect_refusal(folder, again + "b.obj", 2, "its name is that of a mesh; choose one that ends in .vps.hdf");
  expect_refusal(folder, again + "nofolder/a.vps.hdf", 2, "the folder does not exist");
  expect_refusal(folder, "absent.obj --voxel 10mm --cache cache", 2, "absent.obj: the file does not exist");
}

TEST(CliCache, ProcessesMayUseItAtTheSameTime) {
  const TemporaryFolder folder;
  std::vector<pid_t> children;
  for (int i = 0; i < 6; ++i) children.push_back(start_bake(folder, "a" + std::to_string(i) + ".vps.hdf"));
  for (const pid_t child : children) EXPECT_EQ(status_of(child), 0);
  for (int i = 1; i < 6; ++i)
    EXPECT_EQ(read_file(folder / ("a" + std::to_string(i) + ".vps.hdf")), read_file(folder / "a0.vps.hdf"));
  EXPECT_EQ(files_of_entries(folder / "cache").size(), 2U);
  EXPECT_EQ(vpsbake(folder, "cache verify --cache cache").code, 0);
  EXPECT_EQ(use_of_cache(folder, sample("cube") + " --voxel 10mm -o b.vps.hdf --cache cache"), "hit");
}

}  // namespace
}  // namespace vps::test

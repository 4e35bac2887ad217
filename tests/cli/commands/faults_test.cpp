// SPDX-License-Identifier: GPL-3.0-or-later
// A bake leaves whole files or none when it is killed, when the disk is full or not writable, when another bake writes
// the same file, and while its mesh is being written.
#include <sys/mount.h>
#include <sys/resource.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/cli/program.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

#if defined(VPS_SANITIZE)
constexpr int kSlower = 5;  // divides the number of repetitions
#else
constexpr int kSlower = 1;
#endif

bool is_root() {
  return ::geteuid() == 0;
}

// Every visible file of the cache belongs to a whole entry with correct hashes.
void expect_sound(const TemporaryFolder& folder) {
  if (!fs::exists(folder / "cache")) return;
  const Outcome verified = vpsbake(folder, "cache verify --cache cache");
  EXPECT_EQ(verified.code, 0) << verified.err;
}

// The run succeeds with one warning about the cache.
void expect_warning(const Outcome& run, const std::string& why) {
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_TRUE(run.err.starts_with("vpsbake: warning: ")) << run.err;
  EXPECT_TRUE(run.err.ends_with("; the asset is not kept there\n")) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
}

// A small file system in memory.
class SmallDisk {
 public:
  explicit SmallDisk(const fs::path& folder) : folder_(folder) {
    fs::create_directory(folder);
    mounted_ = ::mount("none", folder.c_str(), "tmpfs", 0, "size=96k,mode=755") == 0;
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    if (mounted_) ::umount(folder_.c_str());
  }
  [[nodiscard]] bool is_mounted() const { return mounted_; }
  [[nodiscard]] bool lock() const {
    return ::mount("none", folder_.c_str(), "tmpfs", MS_REMOUNT | MS_RDONLY, "size=96k") == 0;
  }

 private:
  fs::path folder_;
  bool mounted_ = false;
};

#define VPS_SMALL_DISK_OR_SKIP(disk) \
  if (!(disk).is_mounted()) GTEST_SKIP() << "needs to mount a tmpfs, as root"

// Waits until a bake has created its cache folder, to which it writes first, or has ended.
void wait_for_writing(const TemporaryFolder& folder, pid_t child) {
  siginfo_t ended{};
  while (!fs::exists(folder / "cache") && ended.si_pid == 0) {
    ASSERT_EQ(::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT), 0);
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

// A killed bake has left only whole files.
void expect_whole(const TemporaryFolder& folder, const std::string& whole) {
  EXPECT_TRUE(!fs::exists(folder / "a.vps.hdf") || read_file(folder / "a.vps.hdf") == whole);
  for (const fs::path& file : files_of_entries(folder / "cache")) {
    if (file.extension() == ".hdf") {
      EXPECT_TRUE(read_file(file) == whole) << file;
    }
  }
  for (const std::string& name : folder.names())
    EXPECT_TRUE(name.ends_with(".vps.hdf") || name == "cache" || name.starts_with(".vps.")) << name;
}

// Half of the kills are spread over a whole bake, with or without an existing cache. The other half are spread over the
// end of a bake, where it writes.
class Killed : public testing::TestWithParam<int> {};

TEST_P(Killed, BakeLeavesNothingHalfWritten) {
  constexpr int kKills = 50 / kSlower;
  using Seconds = std::chrono::duration<double>;
  const TemporaryFolder folder;
  Seconds duration{}, writing{};
  for (int i = 0; i < 2; ++i) {  // the first also reads the program from the disk
    fs::remove_all(folder / "cache");
    const auto begin = Clock::now();
    const pid_t child = start_bake(folder, "whole.vps.hdf");
    wait_for_writing(folder, child);
    const auto middle = Clock::now();
    ASSERT_EQ(status_of(child), 0);
    duration = Clock::now() - begin;
    writing = Clock::now() - middle;
  }
  const std::string whole = read_file(folder / "whole.vps.hdf");
  Random random(static_cast<std::uint64_t>(GetParam()));
  int killed = 0;
  for (int i = 0; i < kKills; ++i) {
    const bool while_writing = i % 2 == 1;
    if (while_writing || i % 4 == 0) fs::remove_all(folder / "cache");
    if (i % 3 != 2) fs::remove(folder / "a.vps.hdf");
    const pid_t child = start_bake(folder, "a.vps.hdf");
    if (while_writing) wait_for_writing(folder, child);
    Seconds& longest = while_writing ? writing : duration;
    std::this_thread::sleep_for(random.next() * longest);
    ::kill(child, SIGKILL);
    if (WIFSIGNALED(status_of(child))) {
      ++killed;
    } else {
      longest *= 0.7;  // the machine was busier when it was measured
    }
    expect_whole(folder, whole);
    if (i % 5 != 4) continue;
    expect_sound(folder);
    EXPECT_EQ(status_of(start_bake(folder, "a.vps.hdf")), 0);
    EXPECT_EQ(read_file(folder / "a.vps.hdf"), whole);
  }
  RecordProperty("killed", killed);
  EXPECT_GT(killed, kKills / 4);
  EXPECT_EQ(status_of(start_bake(folder, "a.vps.hdf")), 0);
  EXPECT_EQ(read_file(folder / "a.vps.hdf"), whole);
  EXPECT_EQ(vpsbake(folder, "info a.vps.hdf").code, 0);
  expect_sound(folder);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Killed, testing::Values(1, 2, 3, 4));

const std::string& cube() {
  static const std::string arguments = sample("cube") + " --voxel 10mm -o ";
  return arguments;
}

TEST(FullDisk, RefusesTheOutputAndLeavesNothing) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  write_file(folder / "disk/filler", std::string(60 << 10, 'x'));
  expect_refusal(folder, cube() + "disk/a.vps.hdf", 2,
                 "disk/a.vps.hdf: no space is left for the file; free some or choose another output");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "disk"), {}), 1);
}

TEST(FullDisk, KeepsTheOutputThatWasThere) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  ASSERT_EQ(vpsbake(folder, cube() + "disk/a.vps.hdf").code, 0);
  const std::string whole = read_file(folder / "disk/a.vps.hdf");
  expect_refusal(folder, cube() + "disk/a.vps.hdf --fields layers,scaled,real", 2, "no space is left");
  EXPECT_EQ(read_file(folder / "disk/a.vps.hdf"), whole);
}

TEST(FullDisk, OfTheDepfileLeavesNoAsset) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  write_file(folder / "disk/filler", std::string(96 << 10, 'x'));
  expect_refusal(folder, cube() + "a.vps.hdf --depfile disk/d", 2, "disk/d: no space is left for the file");
}

TEST(FullDisk, OfTheCacheCostsOneLine) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  write_file(folder / "disk/filler", std::string(60 << 10, 'x'));
  expect_warning(vpsbake(folder, cube() + "a.vps.hdf --cache disk/cache"), "disk/cache: no space is left for the file");
  EXPECT_TRUE(files_of_entries(folder / "disk/cache").empty());
  EXPECT_EQ(vpsbake(folder, "info a.vps.hdf").code, 0);
  EXPECT_EQ(vpsbake(folder, "cache verify --cache disk/cache").code, 0);
  fs::remove(folder / "disk/filler");
  EXPECT_EQ(vpsbake(folder, cube() + "a.vps.hdf --cache disk/cache").err, "");
}

TEST(FullDisk, OrALimitOfFileSizesIsTheSame) {
  const TemporaryFolder folder;
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit limit = before;
  limit.rlim_cur = 32 << 10;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  const Outcome run = vpsbake(folder, cube() + "a.vps.hdf");
  const Outcome both = vpsbake(folder, cube() + "a.vps.hdf --cache cache");
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);  // before anything is printed, as the limit applies to that too
  EXPECT_EQ(run.code, 2);
  EXPECT_EQ(run.err, "vpsbake: error: a.vps.hdf: no space is left for the file; free some or choose another output\n");
  EXPECT_EQ(both.code, 2);
  EXPECT_TRUE(both.err.starts_with("vpsbake: warning: cache: no space is left")) << both.err;
  EXPECT_NE(both.err.find("\nvpsbake: error: a.vps.hdf: no space is left"), std::string::npos) << both.err;
  EXPECT_EQ(folder.names(), std::vector<std::string>{"cache"});
  expect_sound(folder);
}

TEST(ReadOnly, FoldersAreRefusedBeforeTheBake) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  ASSERT_TRUE(disk.lock());
  expect_refusal(folder, cube() + "disk/a.vps.hdf", 2,
                 "disk/a.vps.hdf: the folder may not be written; choose another output");
}

TEST(ReadOnly, CacheHitsAndSaysWhatItDoesNotKeep) {
  const TemporaryFolder folder;
  const SmallDisk disk(folder / "disk");
  VPS_SMALL_DISK_OR_SKIP(disk);
  ASSERT_EQ(vpsbake(folder, cube() + "a.vps.hdf --cache disk --cache-size 1GB").err, "");
  ASSERT_TRUE(disk.lock());
  const Outcome hit = vpsbake(folder, cube() + "b.vps.hdf --cache disk --json");
  EXPECT_EQ(hit.err, "");
  EXPECT_EQ(nlohmann::json::parse(hit.out)["cache"], "hit");
  EXPECT_EQ(read_file(folder / "b.vps.hdf"), read_file(folder / "a.vps.hdf"));
  expect_warning(vpsbake(folder, sample("cube") + " --voxel 20mm -o c.vps.hdf --cache disk"), "disk: ");
  expect_warning(vpsbake(folder, sample("cube") + " --voxel 20mm -o c.vps.hdf --cache disk/absent"), "disk/absent: ");
  EXPECT_EQ(vpsbake(folder, "info c.vps.hdf").code, 0);
  const Outcome pruned = vpsbake(folder, "cache prune --max-size 1B --cache disk");
  EXPECT_EQ(pruned.code, 2);
  EXPECT_NE(pruned.err.find("1 file could not be removed; "), std::string::npos) << pruned.err;
}

// Permissions do not restrict root, so the program runs as nobody.
TEST(Permissions, OfFoldersAreSaidAndOthersCachesHit) {
  if (!is_root() || std::system("setpriv --reuid=65534 --regid=65534 --clear-groups true 2>/dev/null") != 0 ||
      std::system("setpriv --reuid=65534 --regid=65534 --clear-groups test -x " VPSBAKE) != 0)
    GTEST_SKIP() << "needs to become nobody, as root";
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms(0755));
  fs::create_directory(folder / "mine");
  fs::permissions(folder / "mine", fs::perms(0777));
  const auto as_nobody = [&](const std::string& arguments) {
    const std::string command = "cd " + folder.path().string() +
                                " && setpriv --reuid=65534 --regid=65534 --clear-groups " VPSBAKE " " + arguments +
                                " >mine/out.txt 2>mine/err.txt </dev/null";
    const int status = std::system(command.c_str());
    return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read_file(folder / "mine/out.txt"),
                   read_file(folder / "mine/err.txt")};
  };
  ASSERT_EQ(vpsbake(folder, cube() + "a.vps.hdf --cache cache").code, 0);
  const Outcome refused = as_nobody(cube() + "b.vps.hdf");
  EXPECT_EQ(refused.code, 2);
  EXPECT_EQ(refused.err, "vpsbake: error: b.vps.hdf: the folder may not be written; choose another output\n");
  const Outcome hit = as_nobody(cube() + "mine/b.vps.hdf --cache cache --json");
  EXPECT_EQ(hit.err, "");
  EXPECT_EQ(nlohmann::json::parse(hit.out)["cache"], "hit");
  EXPECT_EQ(read_file(folder / "mine/b.vps.hdf"), read_file(folder / "a.vps.hdf"));
  expect_warning(as_nobody(sample("cube") + " --voxel 20mm -o mine/b.vps.hdf --cache cache"), "cache: ");
  fs::permissions(folder / "cache", fs::perms(0700));
  const Outcome closed = as_nobody("cache stats --cache cache");
  EXPECT_EQ(closed.code, 2);
  EXPECT_NE(closed.err.find("Permission denied; check the folder and its permissions\n"), std::string::npos)
      << closed.err;
}

TEST(SameOutput, OfTwoBakesIsAlwaysWhole) {
  const TemporaryFolder folder;
  ASSERT_EQ(status_of(start_bake(folder, "whole.vps.hdf")), 0);
  const std::string whole = read_file(folder / "whole.vps.hdf");
  std::atomic<bool> done = false;
  int seen = 0;
  std::thread reader([&] {
    while (!done) {
      const std::string now = read_file(folder / "a.vps.hdf");
      seen += now == whole ? 1 : 0;
      EXPECT_TRUE(now.empty() || now == whole);
    }
  });
  for (int i = 0; i < 30 / kSlower; ++i) {
    if (i % 2 == 0) fs::remove_all(folder / "cache");
    const pid_t one = start_bake(folder, "a.vps.hdf"), other = start_bake(folder, "a.vps.hdf");
    EXPECT_EQ(status_of(one), 0);
    EXPECT_EQ(status_of(other), 0);
    EXPECT_EQ(read_file(folder / "a.vps.hdf"), whole);
  }
  done = true;
  reader.join();
  EXPECT_GT(seen, 0);
  EXPECT_EQ(folder.names().size(), 3U) << "the cache and two assets";
  expect_sound(folder);
}

// A mesh file that is rewritten continuously, alternating between two versions.
class ChangingMesh {
 public:
  ChangingMesh(fs::path file, std::string first, std::string second)
      : file_(std::move(file)), versions_{std::move(first), std::move(second)}, writer_([this] { write(); }) {}
  ChangingMesh(const ChangingMesh&) = delete;
  ChangingMesh& operator=(const ChangingMesh&) = delete;
  ~ChangingMesh() {
    done_ = true;
    writer_.join();
  }

 private:
  void write() {
    Random random(7);
    for (int i = 0; !done_; ++i) {
      const std::string& version = versions_[i % 2];
      if (i % 4 < 2) {
        write_file(file_, version);  // in place: it is empty for a moment
      } else {
        const fs::path next = file_.parent_path() / "next";
        write_file(next, version);
        fs::rename(next, file_);
      }
      std::this_thread::sleep_for(std::chrono::duration<double>(std::pow(10, random.between(-3.5, -0.7))));
    }
  }
  fs::path file_;
  std::string versions_[2];
  std::atomic<bool> done_ = false;
  std::thread writer_;
};

TEST(ChangingMeshes, GiveTheAssetOfOneVersionOrNone) {
  const TemporaryFolder folder;
  const std::string first = read_file(sample("cube"));
  const std::string second = read_file(sample("thin_plate"));
  const std::string options = " --voxel 2mm --json -o a.vps.hdf";
  std::vector<std::string> assets;
  for (const std::string& version : {first, second}) {
    write_file(folder / "mesh.obj", version);
    ASSERT_EQ(vpsbake(folder, "mesh.obj" + options).code, 0);
    assets.push_back(read_file(folder / "a.vps.hdf"));
  }
  int good = 0;
  {
    const ChangingMesh mesh(folder / "mesh.obj", first, second);
    for (int i = 0; i < 40 / kSlower; ++i) {
      fs::remove(folder / "a.vps.hdf");
      if (i % 2 == 0) fs::remove_all(folder / "cache");
      const Outcome run = vpsbake(folder, "mesh.obj --cache cache" + options);
      if (run.code == 0) {
        ++good;
        const std::string asset = read_file(folder / "a.vps.hdf");
        EXPECT_TRUE(asset == assets[0] || asset == assets[1]) << i;
        EXPECT_EQ(run.err, "");
      } else {
        EXPECT_TRUE(run.code == 2 || run.code == 3) << run.err;
        EXPECT_TRUE(run.err.starts_with("vpsbake: error: mesh.obj: ")) << run.err;
        EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
        EXPECT_FALSE(fs::exists(folder / "a.vps.hdf"));
      }
      for (const fs::path& file : files_of_entries(folder / "cache")) {
        if (file.extension() != ".hdf") continue;
        const std::string asset = read_file(file);
        EXPECT_TRUE(asset == assets[0] || asset == assets[1]) << i;
      }
    }
  }
  EXPECT_GT(good, 0);
  expect_sound(folder);
  // Each entry of the cache belongs to its key.
  for (const std::string& version : {first, second}) {
    write_file(folder / "mesh.obj", version);
    ASSERT_EQ(vpsbake(folder, "mesh.obj --cache cache" + options).code, 0);
    EXPECT_EQ(read_file(folder / "a.vps.hdf"), assets[version == first ? 0 : 1]);
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Batches in parts: planned, distributed, gathered, stopped, killed and explained.
#include <fcntl.h>
#include <spawn.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include "cli/batch/report.h"
#include "runtime/vps_runtime.h"
#include "tests/cli/batch/batch_folder.h"
#include "tests/cli/schema.h"

namespace vps::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlan = "plan meshes -o jobs.jsonl --into out --voxel 10mm";

void add_meshes(const BatchFolder& folder) {
  folder.add("a/cube.obj");
  folder.add("a/twin.obj");
  folder.add("hole.obj", "hole");
  folder.add("peg.obj", "peg");
  folder.add_text("bad.obj", "junk");
}

TEST(BatchParts, SharesGiveTheSameBytesAsOneRun) {
  const BatchFolder folder;
  add_meshes(folder);
  ASSERT_EQ(vpsbake(folder, "batch meshes -o whole --voxel 10mm --jobs 1").code, 5);
  fs::remove(folder / "whole/.vpsbake-run.json");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  EXPECT_EQ(vpsbake(folder, "merge jobs.jsonl").code, 5) << "nothing is baked yet";
  for (const char* share : {"2/3", "3/3", "1/3"})
    (void)vpsbake(folder, std::string("run jobs.jsonl --cache cache --shard ") + share);
  const Outcome merge = vpsbake(folder, "merge jobs.jsonl");
  EXPECT_EQ(merge.code, 5);
  EXPECT_NE(merge.err.find("bad.vps.hdf: it is not there or not what was planned; bake it with vpsbake run jobs.jsonl "
                           "--task 3"),
            std::string::npos)
      << merge.err;
  EXPECT_EQ(files_below(folder / "out"), files_below(folder / "whole"));
}

TEST(BatchParts, AJobsFileMayMoveWithItsTree) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  fs::create_directory(folder / "moved");
  for (const char* name : {"meshes", "jobs.jsonl"}) fs::rename(folder / name, folder / ("moved/" + std::string(name)));
  EXPECT_NE(vpsbake(folder, "run moved/jobs.jsonl --dry-run").out.find("there is no asset yet"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder / "moved/out"));
  EXPECT_EQ(vpsbake(folder, "run moved/jobs.jsonl --task 1").code, 0);
  EXPECT_EQ(vpsbake(folder, "merge moved/jobs.jsonl").code, 0);
  EXPECT_TRUE(fs::exists(folder / "moved/out/cube.vps.hdf"));
}

TEST(BatchParts, WhatIsAdvisedCanBeTyped) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, "plan meshes -o 'my jobs.jsonl' --into out --voxel 10mm").code, 0);
  const Outcome merge = vpsbake(folder, "merge 'my jobs.jsonl'");
  EXPECT_EQ(merge.code, 5);
  EXPECT_NE(merge.err.find("vpsbake run 'my jobs.jsonl' --task 1"), std::string::npos) << merge.err;
  expect_refusal(folder, "explain meshes/cube.obj", 3, "give the folder of its assets with -o");
  expect_refusal(folder, "explain meshes/cube.obj -o none", 1,
                 "--output: there is no folder none; run vpsbake explain --help");
}

TEST(BatchParts, AnIgnoredSignalStaysIgnored) {
  const BatchFolder folder;
  for (const char* mesh : {"cube", "hole", "peg", "nut"}) folder.add(std::string(mesh) + ".obj", mesh);
  const std::string line = "cd " + folder.path().string() +
                           " && trap '' HUP && { " VPSBAKE
                           " batch meshes -o out --voxel 2mm >log.txt 2>&1 & p=$!; for i in $(seq 20); do kill -HUP $p "
                           "2>/dev/null; sleep 0.02; done; wait $p; }";
  EXPECT_EQ(std::system(line.c_str()), 0) << read_file(folder / "log.txt");
}

TEST(BatchParts, WhatLinesAndScriptsCannotHoldIsRefused) {
  const BatchFolder folder;
  folder.add("cube.obj");
  folder.add("l\xe4t.obj", "peg");
  const Outcome plan = vpsbake(folder, kPlan);
  EXPECT_EQ(plan.code, 0);
  EXPECT_NE(plan.err.find("its name is not UTF-8"), std::string::npos) << plan.err;
  const Outcome run = vpsbake(folder, "run jobs.jsonl");
  EXPECT_EQ(run.code, 5);
  EXPECT_NE(run.err.find("its name is not UTF-8"), std::string::npos) << run.err;
  fs::create_directory(folder / "{}");
  expect_refusal(folder, "plan meshes -o '{}/jobs.jsonl' --into out --voxel 10mm --emit parallel", 1,
                 "names with braces or line breaks do not go into scripts");
}

TEST(BatchParts, BadSharesAndJobsAreRefused) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  for (const char* share : {"0/3", "4/3", "1", "1/3x", "-1/2", "a/b"})
    expect_refusal(folder, std::string("run jobs.jsonl --shard ") + share, 1, "--shard takes i/n with 1 <= i <= n");
  EXPECT_EQ(vpsbake(folder, "run jobs.jsonl --shard 100001/99999999").out, "no job in share 100001/99999999\n");
  expect_refusal(folder, "run jobs.jsonl --task 2", 3, "there is no job 2; it has 1");
  expect_refusal(folder, "run absent.jsonl", 2, "the file cannot be read");
  write_file(folder / "bad.jsonl", "{}\n");
  expect_refusal(folder, "run bad.jsonl", 3, "bad.jsonl:1: this is not a line that vpsbake plan writes");
  write_file(folder / "bad.jsonl",
             R"({"mesh": "m.obj", "folder": "out", "output": "../../x.vps.hdf", "options": {"voxel": "1mm"}})");
  expect_refusal(folder, "run bad.jsonl", 3, "not the name of an asset below its folder");
  write_file(folder / "bad.jsonl",
             R"({"mesh": "m.obj", "folder": "out", "output": "x.vps.hdf", "options": {"output": "/etc/x"}})");
  expect_refusal(folder, "run bad.jsonl", 3, "bad.jsonl:1: ");
}

TEST(BatchParts, AnAssetOfTwoLinesIsRefused) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  write_file(folder / "jobs.jsonl", read_file(folder / "jobs.jsonl") + read_file(folder / "jobs.jsonl"));
  for (const char* command : {"run jobs.jsonl", "merge jobs.jsonl"})
    expect_refusal(folder, command, 3, "jobs.jsonl:2: its asset is that of an earlier line");
}

TEST(BatchParts, ALinkedMeshIsBakedAsItIsNamed) {
  const BatchFolder folder;
  fs::create_directories(folder / "store");
  fs::create_directories(folder / "meshes");
  fs::copy_file(sample("cube"), folder / "store/0123");
  fs::create_symlink("../store/0123", folder / "meshes/cube.obj");
  fs::create_symlink("loop.obj", folder / "meshes/loop.obj");
  EXPECT_EQ(vpsbake(folder, kPlan).code, 0);
  EXPECT_EQ(vpsbake(folder, "run jobs.jsonl").code, 5);
  ASSERT_EQ(vpsbake(folder, "batch meshes -o whole --voxel 10mm").code, 5);
  EXPECT_EQ(vpsbake(folder, "merge jobs.jsonl").code, 5);
  fs::remove(folder / "whole/.vpsbake-run.json");
  EXPECT_EQ(files_below(folder / "out"), files_below(folder / "whole"));
}

TEST(BatchParts, MergeReadsAllOfAnAssetWhenAsked) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  ASSERT_EQ(vpsbake(folder, "run jobs.jsonl").code, 0);
  EXPECT_EQ(vpsbake(folder, "merge jobs.jsonl --verify").code, 0);
  std::string damaged = folder.asset("cube.vps.hdf");
  damaged[damaged.size() / 2] ^= 1;
  write_file(folder / "out/cube.vps.hdf", damaged);
  EXPECT_EQ(vpsbake(folder, "merge jobs.jsonl --verify").code, 5);
  write_file(folder / "out/cube.vps.hdf", damaged.substr(0, damaged.size() / 2));
  EXPECT_EQ(vpsbake(folder, "merge jobs.jsonl").code, 5) << "its header says how long it is";
}

TEST(BatchParts, AScriptReplacesNoOther) {
  const BatchFolder folder;
  folder.add("cube.obj");
  const std::string plan = std::string(kPlan) + " --emit parallel";
  EXPECT_EQ(vpsbake(folder, plan).code, 0);
  EXPECT_EQ(vpsbake(folder, plan).code, 0) << "its own";
  fs::remove(folder / "jobs.jsonl");
  write_file(folder / "jobs.sh", "#!/bin/sh\nprecious\n");
  expect_refusal(folder, plan, 2, "jobs.sh: the file exists and is not a script of vpsbake plan");
}

TEST(BatchParts, JobsFollowTheirSchema) {
  VPS_SCHEMA_CHECK_OR_SKIP();
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, kPlan).code, 0);
  EXPECT_TRUE(follows_schema(folder / "jobs.jsonl", "job.schema.json"));  // the file is one line: one JSON object
}

TEST(BatchParts, ScriptsAreEmittedForEngines) {
  const BatchFolder folder;
  for (const char* name : {"a.obj", "b.obj", "c.obj"}) folder.add(name);
  for (const auto& [engine, file, start] : {std::tuple{"slurm", "jobs.sbatch", "#SBATCH --array=1-2"},
                                            std::tuple{"snakemake", "jobs.smk", "range(1, 2 + 1)"},
                                            std::tuple{"parallel", "jobs.sh", "seq 2 | parallel"}}) {
    const Outcome run = vpsbake(folder, std::string(kPlan) + " --cache 'my cache' --tasks 2 --emit " + engine);
    EXPECT_EQ(run.code, 0) << run.err;
    const std::string script = read_file(folder / file);
    EXPECT_NE(script.find(start), std::string::npos) << script;
    EXPECT_NE(script.find("/my cache"), std::string::npos) << script;
    EXPECT_NE(script.find("vpsbake merge"), std::string::npos) << script;
  }
}

TEST(BatchParts, ExplainNamesTheSettingThatChanged) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, "batch meshes -o out --voxel 10mm").code, 0);
  ASSERT_EQ(vpsbake(folder, "batch meshes -o out --voxel 8mm --unit cm --scale 100").code, 0);
  const Outcome changed = vpsbake(folder, "explain out/cube.vps.hdf");
  EXPECT_EQ(changed.out, "last batch: baked\n  voxel was 10 mm, is 8 mm\nnow: up to date\n");
  ASSERT_EQ(vpsbake(folder, "batch meshes -o out --voxel 8mm").code, 0);
  write_file(folder / "meshes/cube.obj", read_file(folder / "meshes/cube.obj") + "# edited\n");
  const Outcome same = vpsbake(folder, "explain meshes/cube.obj -o out");
  EXPECT_EQ(same.out,
            "last batch: unchanged\n  the mesh's bytes, every setting and the program were the same\n"
            "now: the same batch would bake it again\n  the mesh changed\n");
  folder.add_text("vpsbake.toml", "voxel = \"9mm\"\n");
  EXPECT_NE(vpsbake(folder, "explain out/cube.vps.hdf").out.find("  voxel was 8 mm, is 9 mm\n"), std::string::npos);
  ASSERT_EQ(vpsbake(folder, "meshes/cube.obj --voxel 10mm -o alone.vps.hdf").code, 0);
  const Outcome alone = vpsbake(folder, "explain alone.vps.hdf");
  EXPECT_EQ(alone.code, 0) << alone.err;
  EXPECT_NE(alone.out.find("\n  voxel 10 mm\n"), std::string::npos) << alone.out;
  // A batch is known, but it does not bake this one.
  folder.add_text("vpsbake.toml", "[[files]]\nmatch = \"cube.obj\"\nskip = true\n");
  folder.add("torus.obj");
  ASSERT_EQ(vpsbake(folder, "batch meshes -o out --voxel 20mm").code, 0);
  EXPECT_TRUE(vpsbake(folder, "explain out/cube.vps.hdf").out.starts_with("no batch in its folder bakes it; "));
  expect_refusal(folder, "explain absent.vps.hdf", 2, "absent.vps.hdf");
}

TEST(BatchParts, ExplainKnowsWhatTheSameBatchWouldRefuse) {
  const BatchFolder folder;
  folder.add("cube.obj");
  ASSERT_EQ(vpsbake(folder, "batch meshes -o out --voxel 10mm").code, 0);
  folder.add_text("cube.off", "OFF\n0 0 0\n");  // would be written to the same asset
  const Outcome now = vpsbake(folder, "explain out/cube.vps.hdf");
  EXPECT_NE(now.out.find("now: the same batch would refuse it\n"), std::string::npos) << now.out;
}

// Starts a batch without waiting for it; its output is not read.
pid_t start(const BatchFolder& folder, const std::string& arguments) {
  const std::string command = "cd " + folder.path().string() + " && exec " + VPSBAKE + " " + arguments;
  const char* const words[] = {"sh", "-c", command.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_WRONLY, 0);
  pid_t child = -1;
  EXPECT_EQ(::posix_spawn(&child, "/bin/sh", &actions, nullptr, const_cast<char**>(words), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  return child;
}

int wait_for(pid_t child) {
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

void expect_whole_assets(const fs::path& folder, const std::map<std::string, std::string>& whole) {
  if (!fs::exists(folder)) return;
  for (const auto& [name, bytes] : files_below(folder)) {
    ASSERT_TRUE(whole.count(name) > 0) << name << " is left behind";
    if (name.ends_with(".vps.hdf")) {
      EXPECT_EQ(bytes, whole.at(name)) << name;
    }
  }
}

TEST(BatchParts, AKilledBatchLeavesWholeAssetsAloneAndGoesOn) {
  const BatchFolder folder;
  for (int i = 0; i < 4; ++i) {
    const std::string name = "cube" + std::to_string(i) + ".obj";
    folder.add(name);
    write_file(folder / ("meshes/" + name), read_file(folder / ("meshes/" + name)) + "# " + name + "\n");
  }
  const std::string bake = "batch meshes --voxel 4mm --no-cache -o ";
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(wait_for(start(folder, bake + "whole")), 0);
  const auto whole_time = std::chrono::steady_clock::now() - begin;
  const auto whole = files_below(folder / "whole");
  std::uint32_t random = 1;
  for (int kill = 0; kill < 12; ++kill) {
    random = random * 1664525 + 1013904223;
    const pid_t batch = start(folder, bake + "out");
    std::this_thread::sleep_for(whole_time * (random >> 16) / 65536);
    ::kill(batch, kill % 2 == 0 ? SIGKILL : SIGTERM);
    (void)wait_for(batch);
    expect_whole_assets(folder / "out", whole);
    if (kill % 4 == 3) fs::remove_all(folder / "out");
  }
  ASSERT_EQ(wait_for(start(folder, bake + "out")), 0);
  auto files = files_below(folder / "out");
  EXPECT_EQ(files.size(), whole.size());
  for (const auto& [name, bytes] : files) {
    if (name != ".vpsbake-run.json") {
      EXPECT_EQ(bytes, whole.at(name)) << name;
    }
  }
}

TEST(BatchParts, WhatAStoppedBatchHasNotStartedDidNotFail) {
  using namespace cli::batch;
  const BatchFolder folder;
  folder.add("cube.obj");
  const Job job{folder / "meshes/cube.obj", folder / "out", "cube.vps.hdf", {{"voxel", "10mm"}}, {}, {}};
  const std::vector<Job> jobs = {job};
  RunOptions options;
  options.jobs = 1;
  const auto ignore = [](const auto&...) {};
  const std::vector<JobResult> results = run_jobs(jobs, options, {ignore, ignore, ignore}, true);
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].state, JobResult::State::not_started);
  EXPECT_TRUE(any_failed(results));
  EXPECT_EQ(to_table(jobs, results, 0), "1 mesh: 1 not started; 0.0 s\n");
  EXPECT_NE(to_table(jobs, results, 0, TableRows::all).find("  not started  cube.vps.hdf"), std::string::npos);
  EXPECT_NE(to_junit(jobs, results).find("<skipped message=\"the batch was stopped before; run it again\""),
            std::string::npos);
  write_file(folder / "run.json", to_json(jobs, results).dump());
  EXPECT_EQ(nlohmann::json::parse(read_file(folder / "run.json"))["items"][0]["state"], "not started");
  VPS_SCHEMA_CHECK_OR_SKIP();
  EXPECT_TRUE(follows_schema(folder / "run.json", "batch.schema.json"));
}

TEST(BatchParts, TwoBatchesOnOneFolderBothEndWell) {
  const BatchFolder folder;
  for (const char* name : {"a.obj", "b.obj"}) folder.add(name);
  folder.add("hole.obj", "hole");
  const std::string bake = "batch meshes --voxel 6mm --cache cache -o ";
  ASSERT_EQ(wait_for(start(folder, "batch meshes --voxel 6mm --no-cache -o whole")), 0);
  for (int round = 0; round < 3; ++round) {
    const pid_t first = start(folder, bake + "out");
    const pid_t second = start(folder, bake + "out");
    EXPECT_EQ(wait_for(first), 0);
    EXPECT_EQ(wait_for(second), 0);
    for (const auto& [name, bytes] : files_below(folder / "out")) {
      if (name != ".vpsbake-run.json") {
        EXPECT_EQ(bytes, read_file(folder / ("whole/" + name))) << name;
      }
    }
    fs::remove_all(folder / "out");
    if (round == 1) fs::remove_all(folder / "cache");
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs the program as a user does, in a temporary folder.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace vps::test {

struct Outcome {
  int code = -1;
  std::string out, err;
};

/// @param cache  the environment's VPSBAKE_CACHE; empty: none
inline Outcome vpsbake(const TemporaryFolder& folder, const std::string& arguments, const std::string& cache = "") {
  const std::string command = "cd " + folder.path().string() + " && VPSBAKE_CACHE=" + cache + " " + VPSBAKE + " " +
                              arguments + " >out.txt 2>err.txt </dev/null";
  const int status = std::system(command.c_str());
  const Outcome run{WIFEXITED(status) ? WEXITSTATUS(status) : 128, read_file(folder / "out.txt"),
                    read_file(folder / "err.txt")};
  std::filesystem::remove(folder / "out.txt");
  std::filesystem::remove(folder / "err.txt");
  return run;
}

/// The bytes of the asset that the program bakes.
/// @param arguments  without -o
inline std::string file_baked(const TemporaryFolder& folder, const std::string& arguments) {
  const Outcome run = vpsbake(folder, arguments + " -o baked.vps.hdf");
  EXPECT_EQ(run.code, 0) << run.err;
  const std::string bytes = read_file(folder / "baked.vps.hdf");
  std::filesystem::remove(folder / "baked.vps.hdf");
  return bytes;
}

inline std::string sample(const char* name) {
  return std::string(VPS_SAMPLE_MESHES) + "/" + name + ".obj";
}

/// Expects one line on stderr that starts with the program's name, and no new files.
inline void expect_refusal(const TemporaryFolder& folder, const std::string& arguments, int code,
                           const std::string& why) {
  const std::vector<std::string> before = folder.names();
  const Outcome run = vpsbake(folder, arguments);
  EXPECT_EQ(run.code, code) << arguments << ": " << run.err;
  EXPECT_TRUE(run.err.starts_with("vpsbake: error: ")) << run.err;
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  EXPECT_NE(run.err.find(why), std::string::npos) << arguments << ": " << run.err;
  EXPECT_EQ(folder.names().size(), before.size()) << arguments;
}

/// Starts a bake of a sample with the folder's cache `cache`, and discards what it prints.
inline pid_t start_bake(const TemporaryFolder& folder, const std::string& output) {
  const std::string mesh = sample("cube");
  const std::string path = folder / output;
  const std::string cache = folder / "cache";
  const char* const arguments[] = {VPSBAKE,      mesh.c_str(), "--voxel",     "10mm", "-o",
                                   path.c_str(), "--cache",    cache.c_str(), nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  for (const int fd : {STDOUT_FILENO, STDERR_FILENO})
    posix_spawn_file_actions_addopen(&actions, fd, "/dev/null", O_WRONLY, 0);
  pid_t child = -1;
  EXPECT_EQ(::posix_spawn(&child, VPSBAKE, &actions, nullptr, const_cast<char**>(arguments), environ), 0);
  posix_spawn_file_actions_destroy(&actions);
  return child;
}

inline int status_of(pid_t child) {
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return status;
}

/// Everything below the two-digit folders of a cache, by name.
inline std::vector<std::filesystem::path> files_of_entries(const std::filesystem::path& cache) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::exists(cache)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(cache))
    if (entry.path().parent_path() != cache) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace vps::test

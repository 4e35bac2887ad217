// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs the program as a user does, in a folder of the test's own.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

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

inline std::string sample(const char* name) {
  return std::string(VPS_SAMPLE_MESHES) + "/" + name + ".obj";
}

/// One line, the program's name first, and nothing left behind.
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

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/child_program.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>
#include <thread>

namespace vps::cli::batch {
namespace {

using End = ProgramResult::End;

std::vector<char> kept;

// The program under test: its first word says what to do.
int play(int argc, char** argv) {
  static int earlier = 0;
  const std::string word = argc > 1 ? argv[1] : "";
  std::printf("%d %d", ::getpid(), earlier++);
  std::fflush(stdout);
  if (word == "crash") ::raise(SIGABRT);
  if (word == "crash unless first" && earlier > 1) ::raise(SIGABRT);
  if (word == "hang") std::this_thread::sleep_for(std::chrono::hours(1));
  if (word == "keep") kept.assign(64'000'000, 'x');
  if (word == "use") {
    kept.assign(64'000'000, 'x');
    std::vector<char>().swap(kept);
  }
  if (word == "complain") std::fputs("no", stderr);
  return word == "complain" ? 3 : 0;
}

class ChildProgram : public testing::Test {
 protected:
  static void SetUpTestSuite() { prepare_programs(play); }

  // Of the program's process: its number, and how many programs it ran earlier.
  struct Process {
    int number = 0, earlier = -1;
  };
  static Process process_of(const ProgramResult& result) {
    Process process;
    EXPECT_EQ(std::sscanf(result.out.c_str(), "%d %d", &process.number, &process.earlier), 2) << result.out;
    return process;
  }
  ProgramResult run(const std::string& word, double timeout = 0) const { return run_program({word}, timeout, stop_); }

  std::atomic<bool> stop_ = false;
};

TEST_F(ChildProgram, OneProcessRunsOneAfterAnother) {
#ifdef VPS_SANITIZE
  GTEST_SKIP() << "a sanitized process keeps too much memory to be used again";
#endif
  const ProgramResult first = run("tell"), second = run("complain"), third = run("tell");
  EXPECT_EQ(first.end, End::exited);
  EXPECT_EQ(second.code, 3);
  EXPECT_EQ(second.err, "no");
  EXPECT_EQ(third.code, 0);
  EXPECT_EQ(third.err, "");
  EXPECT_EQ(process_of(first).number, process_of(third).number);
  EXPECT_NE(process_of(first).number, ::getpid());
  EXPECT_EQ(process_of(third).earlier, process_of(first).earlier + 2);
}

TEST_F(ChildProgram, ThreadsHaveProcessesOfTheirOwn) {
  ProgramResult slow;
  std::thread other([&] { slow = run("hang", 0.3); });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const ProgramResult quick = run("tell");
  other.join();
  EXPECT_EQ(slow.end, End::timed_out);
  EXPECT_EQ(quick.end, End::exited);
  EXPECT_NE(process_of(quick).number, process_of(slow).number);
  EXPECT_EQ(run("tell").end, End::exited);
}

TEST_F(ChildProgram, ACrashIsJudgedInANewProcess) {
  run("tell");
  const ProgramResult crashed = run("crash");
  EXPECT_EQ(crashed.end, End::killed);
  EXPECT_EQ(crashed.code, SIGABRT);
  const ProgramResult whole = run("crash unless first");
  EXPECT_EQ(whole.end, End::exited);
  run("tell");
  EXPECT_EQ(run("crash unless first").end, End::exited);
}

TEST_F(ChildProgram, MemoryIsCountedForEachAndNotKept) {
  run("tell");
  const ProgramResult big = run("use"), keeping = run("keep"), small = run("tell");
  EXPECT_GT(big.peak_memory_bytes, 64'000'000U);
  EXPECT_GT(keeping.peak_memory_bytes, 64'000'000U);
  EXPECT_EQ(process_of(small).earlier, 0);
#ifndef VPS_SANITIZE
  EXPECT_LT(small.peak_memory_bytes, 64'000'000U);
  run("use");
  EXPECT_LT(run("tell").peak_memory_bytes, 64'000'000U);
#endif
}

TEST_F(ChildProgram, AStopEndsIt) {
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    stop_ = true;
  });
  EXPECT_EQ(run("hang").end, End::stopped);
  stopper.join();
}

TEST_F(ChildProgram, TooManyWordsAreRefused) {
  const ProgramResult result = run(std::string(1 << 18, 'x'));
  EXPECT_EQ(result.end, End::cannot_start);
  EXPECT_EQ(result.code, E2BIG);
  EXPECT_EQ(run(std::string(100'000, 'x')).end, End::exited);
}

}  // namespace
}  // namespace vps::cli::batch

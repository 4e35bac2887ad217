// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs this program in child processes, so that a crash, a hang or too much memory there does no harm here.
/// A child runs one program after another: loading the program and its sixty libraries for each, and faulting in fresh
/// memory, would take a quarter of the time of a small bake. Children are forked from a process that was forked early
/// and does nothing else.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

namespace vps::cli::batch {

struct ProgramResult {
  enum class End { exited, killed, timed_out, stopped, cannot_start };
  End end = End::cannot_start;
  int code = 0;  ///< exit code, signal, or errno when it cannot start
  std::string out, err;
  double seconds = 0;
  std::size_t peak_memory_bytes = 0;  ///< largest resident size of the process, with what earlier programs left there
};

/// As main(): takes its arguments, and returns the exit code.
using Program = int (*)(int argc, char** argv);

/// Starts the process from which children are forked. Call it once, before this process has other threads.
void prepare_programs(Program program);

/// Runs `vpsbake WORDS...` in a child, which runs nothing else meanwhile. The child is killed with all its own children
/// when the time is over, when `stop` becomes true, or when this process ends. A program that crashes is run a second
/// time in a new child, unless its own was new. Call `prepare_programs` before.
/// @param timeout  0: none. [s]
[[nodiscard]] ProgramResult run_program(const std::vector<std::string>& words, double timeout,
                                        const std::atomic<bool>& stop);

}  // namespace vps::cli::batch

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs this program as a child: what crashes, hangs or eats memory there stops nothing here.
#pragma once

#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

namespace vps::cli::batch {

struct ProgramResult {
  enum class End { exited, killed, timed_out, stopped, cannot_start };
  End end = End::cannot_start;
  int code = 0;  ///< of the exit, the signal, or the error
  std::string out, err;
  double seconds = 0;
  std::size_t peak_memory_bytes = 0;  ///< resident, of the largest of its processes
};

/// Runs `vpsbake WORDS...` in a process group of its own. It is killed, with all its children, when the time is over,
/// when `stop` becomes true, or when the calling thread ends.
/// @param timeout  0: none. [s]
[[nodiscard]] ProgramResult run_program(const std::vector<std::string>& words, double timeout,
                                        const std::atomic<bool>& stop);

}  // namespace vps::cli::batch

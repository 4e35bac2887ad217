// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs a function in a forked child with limits, and hands back the bytes it wrote. Internal to mesh import.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace vps {

struct ChildLimits {
  std::size_t memory_bytes = 0;  ///< address space
  double timeout = 0;            ///< wall clock and processor time. [s]
};

struct ChildResult {
  enum class End { finished, crashed, out_of_memory, timed_out, cannot_start };
  End end = End::cannot_start;
  int signal = 0;                    ///< with crashed
  std::vector<std::byte> bytes;      ///< with finished: what the child wrote
};

/// Forks, limits the child, runs `work(fd)` there and collects what it writes to `fd`. The child never returns: it ends
/// with _exit, so it may only use memory and that descriptor. std::bad_alloc in the child counts as out_of_memory.
[[nodiscard]] ChildResult run_in_child(const ChildLimits& limits, const std::function<void(int fd)>& work);

/// Writes all bytes or ends the child.
void write_all(int fd, const void* data, std::size_t bytes);

}  // namespace vps

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Work dealt out to threads, and the asset that they share.
#pragma once

#include <cstddef>
#include <thread>
#include <vector>

namespace vps::test {

/// What the program was called with.
extern const char* asset_path;

inline constexpr std::size_t kThreads = 4;

/// Calls task(i) for i below `count` on `workers` threads, dealt out in turn, so that neighbours are never one
/// thread's, however late it starts. With one worker: on the caller's.
template <class Task>
void deal_out(std::size_t count, std::size_t workers, Task task) {
  if (workers == 1) {
    for (std::size_t i = 0; i < count; ++i) task(i);
    return;
  }
  std::vector<std::thread> threads;
  for (std::size_t worker = 0; worker < workers; ++worker) {
    threads.emplace_back([=, &task] {
      for (std::size_t i = worker; i < count; i += workers) task(i);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace vps::test

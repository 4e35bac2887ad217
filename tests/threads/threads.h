// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Distributes work to threads; the asset that they share.
#pragma once

#include <cstddef>
#include <thread>
#include <vector>

namespace vps::test {

/// The program's argument.
extern const char* asset_path;

inline constexpr std::size_t kThreads = 4;

/// Calls task(i) for i below `count` on `workers` threads. Thread t gets every `workers`-th task, so that neighbours
/// always run on different threads. One worker runs on the caller's thread.
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/memory_budget.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace vps::cli::batch {
namespace {

TEST(MemoryBudget, NeverMoreIsTakenThanThereIs) {
  constexpr std::size_t kTotal = 100;
  MemoryBudget budget(kTotal);
  std::atomic<std::size_t> taken = 0, most = 0;
  std::vector<std::thread> threads;
  for (std::size_t thread = 0; thread < 4; ++thread) {
    threads.emplace_back([&, thread] {
      for (std::size_t i = 0; i < 500; ++i) {
        const std::size_t bytes = (i * 37 + thread * 11) % 60 + 1;
        const MemoryBudget::Share share(budget, bytes);
        const std::size_t now = taken += bytes;
        for (std::size_t seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
        }
        std::this_thread::yield();
        taken -= bytes;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_LE(most, kTotal);
}

TEST(MemoryBudget, WhatFitsTogetherIsTakenTogether) {
  MemoryBudget budget(100);
  const MemoryBudget::Share one(budget, 60);
  std::thread([&] { const MemoryBudget::Share other(budget, 40); }).join();
}

TEST(MemoryBudget, WhatIsMoreThanAllOfItWaitsUntilItIsAlone) {
  MemoryBudget budget(10);
  std::atomic<bool> got = false;
  std::thread large;
  {
    const MemoryBudget::Share small(budget, 1);
    large = std::thread([&] {
      const MemoryBudget::Share share(budget, 1000);
      got = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_FALSE(got);
  }
  large.join();
  EXPECT_TRUE(got);
}

TEST(MemoryBudget, SomeMemoryIsAvailable) {
  EXPECT_GT(available_memory(), std::size_t{10'000'000});
}

}  // namespace
}  // namespace vps::cli::batch

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Memory that bakes share: each takes what it will need, and waits until that is there.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace vps::cli::batch {

/// In the order in which they ask, so that a large one is not kept waiting by small ones for ever.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::size_t bytes) : free_(bytes), total_(bytes) {}

  /// What was taken, until it is destroyed.
  class Share {
   public:
    Share(MemoryBudget& budget, std::size_t bytes)
        : budget_(budget), bytes_(bytes < budget.total_ ? bytes : budget.total_) {
      std::unique_lock lock(budget_.mutex_);
      const std::uint64_t ticket = budget_.tickets_++;
      budget_.changed_.wait(lock, [&] { return ticket == budget_.served_ && bytes_ <= budget_.free_; });
      budget_.free_ -= bytes_;
      ++budget_.served_;
      budget_.changed_.notify_all();
    }
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
    ~Share() {
      const std::lock_guard lock(budget_.mutex_);
      budget_.free_ += bytes_;
      budget_.changed_.notify_all();
    }

   private:
    MemoryBudget& budget_;
    std::size_t bytes_;
  };

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t free_, total_;
  std::uint64_t tickets_ = 0, served_ = 0;
};

/// Most that may be used now: what the system says is available, no more than the process's cgroup allows, less a
/// tenth. [bytes]
[[nodiscard]] std::size_t available_memory();

}  // namespace vps::cli::batch

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Memory that bakes share. Each takes the memory that it will need, and waits until it is free.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace vps::cli::batch {

/// Serves requests in their order, so that small ones cannot keep a large one waiting for ever.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::size_t bytes) : free_(bytes), total_(bytes) {}

  /// Waits for memory and holds it until destruction. Takes at most the whole budget.
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

/// Memory that may be used now: what the system has available, at most what the process's cgroup allows, less a tenth.
/// At least 100 MB. [bytes]
[[nodiscard]] std::size_t available_memory();

}  // namespace vps::cli::batch

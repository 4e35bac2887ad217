// SPDX-License-Identifier: Zlib
/// @file The budget of a time-critical query. Internal.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// Limits of a query's tests and time.
class Budget {
 public:
  explicit Budget(const QueryOptions& options) noexcept
      : tests_(options.max_tests > 0 ? options.max_tests : std::numeric_limits<std::uint64_t>::max()),
        microseconds_(options.max_microseconds),
        limited_(options.max_tests > 0 || options.max_microseconds > 0) {
    if (microseconds_ > 0) start_ = Clock::now();
  }
  bool limited() const noexcept { return limited_; }
  /// How many more tests fit after `tests` tests, if `waiting` more will be made in any case.
  std::uint64_t left(std::uint64_t tests, std::uint64_t waiting) const noexcept {
    if (tests + waiting >= tests_) return 0;
    if (microseconds_ > 0) {
      const double spent = std::chrono::duration<double, std::micro>(Clock::now() - start_).count();
      const auto done = static_cast<double>(tests);
      if (spent * (done + kCostWaiting * static_cast<double>(waiting)) >= microseconds_ * done) return 0;
    }
    return tests_ - tests - waiting;
  }
  /// As `left`, but no more than a block of work.
  std::uint64_t left_in_block(std::uint64_t tests, std::uint64_t waiting) const noexcept {
    return std::min(left(tests, waiting), kBlock);
  }
  static constexpr std::uint64_t kBlock = 128;

 private:
  // Waiting tests are single points all over the shell, many of them contacts. Each may cost as much as several earlier
  // tests.
  static constexpr double kCostWaiting = 4;
  using Clock = std::chrono::steady_clock;
  const std::uint64_t tests_;
  const double microseconds_;
  const bool limited_;
  Clock::time_point start_;
};

}  // namespace vps::detail

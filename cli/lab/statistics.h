// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Percentiles of errors and times, and the noise of times.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace vps::lab {

/// The smallest of the values that a share of at least `part` of them does not exceed. @pre not empty
[[nodiscard]] double percentile(std::vector<double> values, double part);

/// Fewer values have no 99th percentile: it would be the largest of them.
inline constexpr std::size_t kFewestForP99 = 100;
inline constexpr double kNoP99 = std::numeric_limits<double>::quiet_NaN();

/// Errors over `asked` poses, of which `told` had an answer. The other numbers are over these; 0 when there are none.
struct Spread {
  std::size_t asked = 0;
  std::size_t told = 0;
  double p50 = 0;
  double rms = 0;
  double p99 = kNoP99;  ///< NaN below kFewestForP99
  double max = 0;
};
/// @param errors  at least 0; NaN: no answer
[[nodiscard]] Spread spread_of(std::span<const double> errors);

/// Times over poses and their noise. A pose's time is the median of its rounds. The noise is twice the largest
/// deviation of a single round, and at least a twentieth of the value. Two runs on one machine differ by no more than
/// the sum of their noises.
struct Times {
  std::size_t rounds = 0;                 ///< 0: not timed
  double p50 = 0, p99 = kNoP99, max = 0;  ///< p99: NaN below kFewestForP99
  double noise_p50 = 0, noise_p99 = kNoP99, noise_max = 0;
};
/// @param rounds  one vector of times per round, over the same poses
[[nodiscard]] Times times_of(const std::vector<std::vector<double>>& rounds);

}  // namespace vps::lab

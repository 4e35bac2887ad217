// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What many numbers come to.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vps::lab {

/// The smallest of them that at least `part` of them do not exceed. @pre not empty
[[nodiscard]] double percentile(std::vector<double> values, double part);

/// Errors over poses: of `asked` poses `told` had an answer; the rest is about these. All 0 when none had.
struct Spread {
  std::size_t asked = 0;
  std::size_t told = 0;
  double p50 = 0;
  double rms = 0;
  double p99 = 0;
  double max = 0;
};
/// @param errors  at least 0; NaN: not told
[[nodiscard]] Spread spread_of(std::span<const double> errors);

/// Times over poses, each the median of its rounds, and their noise: twice what a single round is off at most, at least
/// a twentieth. Of two runs on one machine each is within the noise of both.
struct Times {
  std::size_t rounds = 0;  ///< 0: not timed
  double p50 = 0, p99 = 0, max = 0;
  double noise_p50 = 0, noise_p99 = 0, noise_max = 0;
};
/// @param rounds  one vector of times per round, over the same poses
[[nodiscard]] Times times_of(const std::vector<std::vector<double>>& rounds);

}  // namespace vps::lab

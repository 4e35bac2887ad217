// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The settings that no other one beats in both of two numbers.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace vps::lab {

/// What it costs and what it errs; NaN: not known, and not on the front.
struct Candidate {
  double cost = 0;
  double error = 0;
  double noise = 0;  ///< of the cost
};

/// Another measurement may have them the other way round.
[[nodiscard]] inline bool within_noise(const Candidate& a, const Candidate& b) {
  return std::abs(a.cost - b.cost) <= a.noise + b.noise;
}

/// Numbers of the candidates that none other has as little or less of both and less of one: by cost, from the cheapest.
/// Of equal ones, the first.
[[nodiscard]] std::vector<std::size_t> pareto_front(std::span<const Candidate> candidates);

}  // namespace vps::lab

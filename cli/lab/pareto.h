// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The Pareto front of candidates by cost and error.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace vps::lab {

/// A candidate with NaN as cost or error is not on the front.
struct Candidate {
  double cost = 0;
  double error = 0;
  double noise = 0;  ///< of the cost
};

/// Whether the costs differ by no more than their noise: another measurement may order them the other way.
[[nodiscard]] inline bool within_noise(const Candidate& a, const Candidate& b) {
  return std::abs(a.cost - b.cost) <= a.noise + b.noise;
}

/// Indices of the candidates that no other dominates, from the cheapest. A candidate dominates another when its cost
/// and error are no larger and one of them is smaller. Of equal candidates the first is taken.
[[nodiscard]] std::vector<std::size_t> pareto_front(std::span<const Candidate> candidates);

}  // namespace vps::lab

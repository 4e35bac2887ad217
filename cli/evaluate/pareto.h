// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The settings that no other one beats in both of two numbers.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace vps::evaluate {

/// What it costs and what it errs; NaN: not known, and not on the front.
struct Candidate {
  double cost = 0;
  double error = 0;
};

/// Numbers of the candidates that none other has as little or less of both and less of one: by cost, from the cheapest.
/// Of equal ones, the first.
[[nodiscard]] std::vector<std::size_t> pareto_front(std::span<const Candidate> candidates);

}  // namespace vps::evaluate

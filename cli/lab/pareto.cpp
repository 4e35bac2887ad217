// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/pareto.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace vps::lab {

std::vector<std::size_t> pareto_front(std::span<const Candidate> candidates) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (!std::isnan(candidates[i].cost) && !std::isnan(candidates[i].error)) order.push_back(i);
  }
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::tuple(candidates[a].cost, candidates[a].error, a) <
           std::tuple(candidates[b].cost, candidates[b].error, b);
  });
  std::vector<std::size_t> front;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    if (!(candidates[i].error < least)) continue;
    least = candidates[i].error;
    front.push_back(i);
  }
  return front;
}

}  // namespace vps::lab

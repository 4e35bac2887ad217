// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/statistics.h"

#include <algorithm>
#include <cmath>

namespace vps::lab {

double percentile(std::vector<double> values, double part) {
  std::sort(values.begin(), values.end());
  // The 1e-9 keeps a rounding error of the product from raising the rank by one.
  const double rank = std::ceil(part * double(values.size()) - 1e-9);
  return values[static_cast<std::size_t>(std::clamp(rank, 1.0, double(values.size()))) - 1];
}

Spread spread_of(std::span<const double> errors) {
  Spread out;
  out.asked = errors.size();
  std::vector<double> told;
  double squares = 0;
  for (const double error : errors) {
    if (std::isnan(error)) continue;
    told.push_back(error);
    squares += error * error;
  }
  out.told = told.size();
  if (told.empty()) return out;
  out.p50 = percentile(told, 0.5);
  out.rms = std::sqrt(squares / double(told.size()));
  if (told.size() >= kFewestForP99) out.p99 = percentile(told, 0.99);
  out.max = percentile(told, 1);
  return out;
}

Times times_of(const std::vector<std::vector<double>>& rounds) {
  Times out;
  out.rounds = rounds.size();
  if (rounds.empty() || rounds[0].empty()) return {};
  std::vector<double> medians;
  for (std::size_t pose = 0; pose < rounds[0].size(); ++pose) {
    std::vector<double> of_pose;
    for (const auto& round : rounds) of_pose.push_back(round[pose]);
    medians.push_back(percentile(std::move(of_pose), 0.5));
  }
  const auto fill = [&](double part, double& value, double& noise) {
    value = percentile(medians, part);
    // Another run may differ by a twentieth even where the rounds agree: other pages of memory, another clock rate.
    noise = value / 20;
    for (const auto& round : rounds) noise = std::max(noise, 2 * std::abs(percentile(round, part) - value));
  };
  fill(0.5, out.p50, out.noise_p50);
  if (medians.size() >= kFewestForP99) fill(0.99, out.p99, out.noise_p99);
  fill(1, out.max, out.noise_max);
  return out;
}

}  // namespace vps::lab

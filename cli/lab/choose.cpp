// SPDX-License-Identifier: GPL-3.0-or-later
// Chooses the setting to recommend among those that were tried.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "bake/quantity_text.h"
#include "cli/lab/pareto.h"
#include "cli/lab/recommend.h"

namespace vps::lab {
namespace {

// The largest ratio of a measured value to its limit; up to 1: no limit is exceeded.
double excess(const Tried& t, const Limits& limits) {
  if (!t.steps.failure.empty()) return std::numeric_limits<double>::infinity();
  double most = 0;
  if (limits.missed > 0) most = std::max(most, t.deepest_missed / limits.missed);
  if (t.misses_beyond_error()) most = std::max(most, t.deepest_missed / t.error());
  if (limits.error > 0) most = std::max(most, t.error() / limits.error);
  if (limits.microseconds > 0) most = std::max(most, t.slowest() / limits.microseconds);
  if (limits.bytes > 0) most = std::max(most, double(t.bytes) / limits.bytes);
  return most;
}

// The first whose steps are as fast as the fastest, within the noise.
std::size_t fastest(const std::vector<Tried>& tried, const std::vector<std::size_t>& within) {
  const auto step = [&](std::size_t i) {
    const Times& times = tried[i].steps.dearest();
    return Candidate{times.p99, 0, times.noise_p99};
  };
  const std::size_t least = *std::min_element(
      within.begin(), within.end(), [&](std::size_t a, std::size_t b) { return step(a).cost < step(b).cost; });
  return *std::find_if(within.begin(), within.end(), [&](std::size_t i) { return within_noise(step(i), step(least)); });
}

std::size_t closest(const std::vector<Tried>& tried, const std::vector<std::size_t>& within) {
  return *std::min_element(within.begin(), within.end(),
                           [&](std::size_t a, std::size_t b) { return tried[a].error() < tried[b].error(); });
}

}  // namespace

double Tried::error() const {
  return std::max({field_bound, penetration.max, distance.max});
}

bool Tried::misses_beyond_error() const {
  return deepest_missed > error();
}

std::vector<std::string> Tried::exceeds(const Limits& limits) const {
  std::vector<std::string> out;
  if (!steps.failure.empty()) out.push_back(steps.failure);
  if (misses_beyond_error() || (limits.missed > 0 && deepest_missed > limits.missed))
    out.push_back("misses contacts up to " + bake::format_length(deepest_missed) + " deep");
  if (limits.error > 0 && error() > limits.error) out.push_back("is off by up to " + bake::format_length(error()));
  if (limits.microseconds > 0 && slowest() > limits.microseconds)
    out.push_back(
        fmt::format("takes {:.3g} us for 99 % of the steps, {:.3g} us with the noise", steps.dearest().p99, slowest()));
  if (limits.bytes > 0 && double(bytes) > limits.bytes) out.push_back("has " + bake::format_bytes(double(bytes)));
  return out;
}

void choose(Recommendation& r) {
  std::sort(r.tried.begin(), r.tried.end(), [](const Tried& a, const Tried& b) { return a.bytes < b.bytes; });
  std::vector<std::size_t> within;
  for (std::size_t i = 0; i < r.tried.size(); ++i) {
    if (excess(r.tried[i], r.limits) < excess(r.tried[r.nearest], r.limits)) r.nearest = i;
    if (r.tried[i].exceeds(r.limits).empty()) within.push_back(i);
  }
  if (within.empty()) return;
  r.chosen = r.limits.error > 0 ? fastest(r.tried, within) : closest(r.tried, within);
  r.nearest = *r.chosen;
}

}  // namespace vps::lab

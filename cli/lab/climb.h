// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Searches the worst case of a measured quantity: random starts, then a local search from the worst of them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "cli/lab/random.h"

namespace vps::lab {

struct ClimbOptions {
  int starts = 1000;       ///< random places. [Limits: value >= 1]
  int climbs = 8;          ///< of the worst of them, each one the start of a local search. [Limits: value >= 0]
  int steps = 80;          ///< tries of a local search. [Limits: value >= 0]
  std::uint64_t seed = 1;  ///< the same seed gives the same answer
};

/// What `measure` returns where the measured promise says nothing.
inline constexpr double kNotCovered = -std::numeric_limits<double>::infinity();

template <class Place>
struct Climbed {
  Place place{};
  double value = kNotCovered;    ///< largest one found
  double started = kNotCovered;  ///< largest one of the random places alone
  int measured = 0;              ///< places that the promise covers
};

/// Steps shrink after a failure and grow after a success, so that about one try in five succeeds.
/// @param start    (Random&) -> Place: a random place
/// @param vary     (const Place&, double step, Random&) -> Place: a place near another. [Limits: 0 < step <= 1]
/// @param measure  (const Place&) -> double: the larger, the worse; kNotCovered
template <class Start, class Vary, class Measure>
auto climb(const ClimbOptions& options, const Start& start, const Vary& vary, const Measure& measure) {
  Random random(options.seed);
  using Place = decltype(start(random));
  struct Try {
    Place place;
    double value;
  };
  Climbed<Place> worst;
  const auto try_at = [&](const Place& place) {
    const double value = measure(place);
    if (value > kNotCovered) ++worst.measured;
    if (value > worst.value) {
      worst.value = value;
      worst.place = place;
    }
    return value;
  };
  std::vector<Try> tries;
  for (int i = 0; i < options.starts; ++i) {
    const Place place = start(random);
    const double value = try_at(place);
    if (value > kNotCovered) tries.push_back({place, value});
  }
  worst.started = worst.value;
  const auto last = tries.begin() + std::min<std::ptrdiff_t>(options.climbs, std::ptrdiff_t(tries.size()));
  std::partial_sort(tries.begin(), last, tries.end(), [](const Try& a, const Try& b) { return a.value > b.value; });
  tries.erase(last, tries.end());
  for (Try& best : tries) {
    double step = 1;
    for (int i = 0; i < options.steps; ++i) {
      const Place place = vary(best.place, step, random);
      const double value = try_at(place);
      const bool better = value > best.value;
      if (better) best = {place, value};
      step = better ? std::min(1.5 * step, 1.0) : 0.9 * step;
    }
  }
  return worst;
}

}  // namespace vps::lab

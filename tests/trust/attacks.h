// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the attacks on promises share. Internal to trust_promises.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/trust/places.h"

namespace vps::test {

using lab::ClimbOptions;
using lab::kNotCovered;

/// Queries compute in float: 10^-6 of the coordinates.
inline double rounding(const Subject& subject) {
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const AssetInfo& info = subject.asset.info();
    largest = std::max({largest, std::abs(info.bounds_min[axis]), std::abs(info.bounds_max[axis])});
  }
  return 1e-6 * largest;
}

template <class Place>
Found found(const lab::Climbed<Place>& climbed) {
  return {climbed.value, climbed.started, climbed.measured};
}

inline const VoxelmapView* map_of(const Subject& subject, Field field) {
  const auto at = subject.maps.find(field);
  return at == subject.maps.end() ? nullptr : &at->second;
}
inline const VoxelmapView* finest(const Subject& subject) {
  const VoxelmapView* const scaled = map_of(subject, Field::scaled);
  return scaled != nullptr ? scaled : map_of(subject, Field::real);
}

/// Promises about a pair: queries of poses.
void add_pair_promises(std::vector<Promise>& all);

}  // namespace vps::test

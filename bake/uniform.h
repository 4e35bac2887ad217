// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Counter-based random numbers: number n does not depend on the thread that draws it. Internal to bake.
#pragma once

#include <cstdint>

namespace vps::bake {

/// SplitMix64 of the counter, in [0, 1).
inline double uniform(std::uint64_t counter) {
  std::uint64_t x = (counter + 1) * 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  x ^= x >> 31;
  return static_cast<double>(x >> 11) * 0x1.0p-53;
}

}  // namespace vps::bake

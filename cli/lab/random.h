// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Deterministic pseudo-random numbers, the same on every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace vps::lab {

/// SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed = 1) : state_(seed) {}
  /// In [0, 1).
  double next() {
    state_ += 0x9E3779B97F4A7C15ull;
    std::uint64_t x = state_;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
  }
  double between(double low, double high) { return low + (high - low) * next(); }

  /// Row-major rotation matrix from a random unit quaternion.
  std::array<double, 9> rotation() {
    double q[4];
    double norm = 0;
    do {
      norm = 0;
      for (double& x : q) {
        x = between(-1, 1);
        norm += x * x;
      }
    } while (norm > 1 || norm < 0.01);
    for (double& x : q) x /= std::sqrt(norm);
    const auto [w, x, y, z] = q;
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  }

 private:
  std::uint64_t state_;
};

}  // namespace vps::lab

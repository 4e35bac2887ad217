// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How much two assets in the same frame differ, in quantities that users see.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/vps_runtime.h"

namespace vps::cli {

/// A setting or scalar with its two values as text; empty where one asset has none.
struct ValueDifference {
  std::string name, a, b;
};

/// Two fields at random points that both store, within the narrower of the bands.
struct FieldDifference {
  Field field{};
  std::size_t points = 0;  ///< that both store
  std::size_t only_a = 0;  ///< random points that only one stores
  std::size_t only_b = 0;
  double max = 0, rms = 0, p99 = 0;  ///< of the difference of V; 0 without points. [m]
  std::array<double, 3> at{};        ///< where `max` was found. [m]
};

/// From the points of one shell to the nearest points of the other.
struct ShellDistance {
  double max = 0, rms = 0;               ///< [m]
  double angle_max = 0, angle_mean = 0;  ///< of the normals there. [rad]
};

struct ShellDifference {
  std::uint32_t points[2] = {}, nodes[2] = {};
  double area[2] = {};  ///< sum of the points' areas. [m^2]
  ShellDistance a_to_b, b_to_a;
};

struct Comparison {
  enum class Same : std::uint8_t {
    bytes,    ///< every byte
    content,  ///< all but the record, the generator's name and HDF5's own bytes
    nothing,
  };
  Same same = Same::bytes;
  std::vector<ValueDifference> settings;  ///< of the records
  std::vector<ValueDifference> facts;     ///< of what `info --json` prints
  std::vector<std::string> sections;      ///< that differ in bytes, shape or type, or that one lacks
  std::vector<FieldDifference> fields;    ///< those that both have; empty when `same` is not nothing
  std::optional<ShellDifference> shell;   ///< when both have one and `same` is nothing
};

/// Compares two assets as if their frames were the same: a moved or rotated asset differs everywhere.
[[nodiscard]] Comparison compare_assets(const Asset& a, const Asset& b);

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One unit of length for numbers that are read together.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace vps::lab {

struct LengthUnit {
  const char* name = "m";
  double size = 1;  ///< [m]
  /// Four digits at most, without the unit.
  [[nodiscard]] std::string number(double metres) const { return fmt::format("{:.4g}", metres / size); }
  /// Four digits at most, with the unit.
  [[nodiscard]] std::string text(double metres) const { return number(metres) + " " + name; }
};

/// The largest unit in which the median of the positive lengths is at least 0.1. Metres when no length is positive.
[[nodiscard]] inline LengthUnit unit_for(std::vector<double> lengths) {
  std::erase_if(lengths, [](double length) { return !(length > 0); });
  if (lengths.empty()) return {};
  std::sort(lengths.begin(), lengths.end());
  constexpr LengthUnit kUnits[] = {{"km", 1e3}, {"m", 1}, {"mm", 1e-3}, {"um", 1e-6}, {"nm", 1e-9}};
  for (const LengthUnit& unit : kUnits) {
    if (lengths[lengths.size() / 2] >= 0.0999 * unit.size) return unit;
  }
  return kUnits[4];
}

}  // namespace vps::lab

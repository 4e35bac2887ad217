// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/quantity_text.h"

#include <fmt/format.h>

#include <cmath>

namespace vps::bake {

std::string format_length(double metres) {
  const double size = std::abs(metres);
  if (size >= 1000) return fmt::format("{:.4g} km", metres / 1000);
  if (size >= 1 || size == 0) return fmt::format("{:.4g} m", metres);
  if (size >= 1e-3) return fmt::format("{:.4g} mm", metres * 1e3);
  return fmt::format("{:.4g} um", metres * 1e6);
}

std::string format_bytes(double bytes, int digits) {
  if (bytes < 1e3) return fmt::format("{:.{}g} B", bytes, digits);
  constexpr const char* kUnits[] = {"kB", "MB", "GB", "TB", "PB"};
  constexpr int kLast = 4;
  double size = bytes / 1e3;
  int unit = 0;
  const double round_up = 1000 - 500 * std::pow(10.0, -digits);  // from here on it is printed as 1000
  for (; size >= round_up && unit < kLast; ++unit) size /= 1e3;
  return fmt::format("{:.{}g} {}", size, digits, kUnits[unit]);
}

std::pair<std::string, std::string> differing_bytes(double a, double b) {
  constexpr int kMost = 17;  // of a double
  int digits = 3;
  auto texts = std::pair(format_bytes(a), format_bytes(b));
  while (texts.first == texts.second && ++digits <= kMost) texts = {format_bytes(a, digits), format_bytes(b, digits)};
  return texts;
}

}  // namespace vps::bake

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

std::string format_bytes(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.3g} GB", bytes / 1e9);
  if (bytes >= 1e6) return fmt::format("{:.3g} MB", bytes / 1e6);
  return fmt::format("{:.3g} kB", bytes / 1e3);
}

}  // namespace vps::bake

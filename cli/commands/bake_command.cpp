// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/bake_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "cli/terminal/units.h"
#include "cli/tools/provenance.h"

namespace vps::cli {
namespace {

// The shortest text that parse_length reads back as exactly this length. @param metres  [m]
std::string exact_length(double metres) {
  std::string shortest;
  for (const auto& [unit, size] : {std::pair{"mm", 1e-3}, {"um", 1e-6}, {"m", 1.0}}) {
    for (int digits = 1; digits <= 17; ++digits) {
      const std::string text = fmt::format("{:.{}f}", metres / size, std::max(0, digits - 1)) + unit;
      if (!(std::strtod(text.c_str(), nullptr) > 0) || parse_length(text) != metres) continue;
      if (shortest.empty() || text.size() < shortest.size()) shortest = text;
      break;
    }
  }
  return shortest.empty() ? fmt::format("{}m", metres) : shortest;
}

}  // namespace

std::string bake_command(const BakeArguments& arguments, const bake::BakeOptions& options) {
  const bake::BakeOptions defaults;
  std::string out = "vpsbake " + quoted_word(arguments.mesh);
  for (const auto& [name, unit] : {std::pair{"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}}) {
    if (arguments.unit == unit) out += fmt::format(" --unit {}", name);
  }
  if (arguments.scale != 1) out += fmt::format(" --scale {}", arguments.scale);
  if (options.repair != defaults.repair) out += fmt::format(" --repair {}", describe(options.repair));
  if (options.sheet_thickness > 0) out += " --open-surface thicken=" + exact_length(options.sheet_thickness);
  out += " --voxel " + exact_length(options.voxel_size);
  if (options.alpha != defaults.alpha) out += fmt::format(" --alpha {}", options.alpha);
  if (options.band_inside != defaults.band_inside) out += fmt::format(" --band-inside {}vx", options.band_inside);
  return out;
}

}  // namespace vps::cli

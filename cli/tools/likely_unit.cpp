// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/likely_unit.h"

namespace vps::cli {

std::string likely_unit(const std::string& format, double longest) {
  // Lengths above which metres are unlikely. [m]
  constexpr double kLongestStl = 3, kLongestFbx = 20, kLongest = 50;
  if (format == "gltf" || format == "glb" || format == "dae") return "m";
  if (format == "fbx") return longest > kLongestFbx ? "cm" : "m";
  // CAD programs and printers write millimetres. Parts of robots come in metres, but are shorter.
  if (format == "stl") return longest > kLongestStl ? "mm" : "m";
  return longest > kLongest ? "mm" : "m";
}

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/likely_unit.h"

#include <algorithm>
#include <cctype>

namespace vps::cli {

std::string likely_unit(const std::filesystem::path& mesh, double longest) {
  // Lengths above which metres are unlikely. [m]
  constexpr double kLongestStl = 3, kLongestFbx = 20, kLongest = 50;
  std::string extension = mesh.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".gltf" || extension == ".glb" || extension == ".dae") return "m";
  if (extension == ".fbx") return longest > kLongestFbx ? "cm" : "m";
  // CAD programs and printers write millimetres. Parts of robots come in metres, but are shorter.
  if (extension == ".stl") return longest > kLongestStl ? "mm" : "m";
  return longest > kLongest ? "mm" : "m";
}

}  // namespace vps::cli

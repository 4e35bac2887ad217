// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Guesses the unit of a mesh file's numbers, so that a wrong one is noticed.
#pragma once

#include <string>

namespace vps::cli {

/// The likely unit of a file's numbers, by its format, such as "stl", and size: "m", "cm" or "mm". "m" wherever metres
/// are plausible, and for glTF and COLLADA, which state their unit. docs/baking.md has the sizes behind it.
/// @param longest  longest side of the mesh, in the file's numbers
[[nodiscard]] std::string likely_unit(const std::string& format, double longest);

}  // namespace vps::cli

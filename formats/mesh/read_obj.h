// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads the positions and faces of an OBJ file. Runs in the child process only. Internal to mesh import.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace vps {

struct PolygonSoup {
  std::vector<std::array<double, 3>> vertices;
  std::vector<std::vector<std::size_t>> polygons;  ///< numbers of vertices, which may not be there
  std::uint64_t skipped_primitives = 0;            ///< points and lines
};

/// Every number is checked. Attributes, groups and free-form surfaces are skipped.
/// @param text  changed: lines are joined
/// @throw ReadError, NeedsAssimp (tidy.h)
[[nodiscard]] PolygonSoup read_obj(std::string& text);

}  // namespace vps

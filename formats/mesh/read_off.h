// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads the positions and faces of an OFF file. Internal to mesh import.
#pragma once

#include <string>

#include "formats/mesh/polygon_soup.h"

namespace vps {

/// Every number is checked. Colours, normals and texture coordinates are skipped.
/// @param text  changed: line ends are made equal
/// @throw ReadError, NeedsAssimp (tidy.h)
[[nodiscard]] PolygonSoup read_off(std::string& text);

}  // namespace vps

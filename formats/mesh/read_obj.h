// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads the positions and faces of an OBJ file. Internal to mesh import.
#pragma once

#include <string>

#include "formats/mesh/polygon_soup.h"

namespace vps {

/// Every number is checked. Attributes, groups and free-form surfaces are skipped.
/// @param text  changed: lines are joined
/// @throw ReadError, NeedsAssimp (tidy.h)
[[nodiscard]] PolygonSoup read_obj(std::string& text);

}  // namespace vps

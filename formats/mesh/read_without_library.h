// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The formats that need no library: OBJ, OFF and binary STL. Internal to mesh import.
#pragma once

#include <optional>
#include <string>

#include "formats/mesh/polygon_soup.h"

namespace vps {

/// @param bytes  of the file, changed: line ends are made equal
/// @return nothing for any other format
/// @throw ReadError, NeedsAssimp (tidy.h)
[[nodiscard]] std::optional<PolygonSoup> read_without_library(std::string& bytes, const std::string& extension);

}  // namespace vps

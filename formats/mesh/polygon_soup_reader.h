// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads OBJ and OFF, and with CGAL PLY and ASCII STL, in double precision. Runs in the child process only.
/// Internal to mesh import.
#pragma once

#include <string>

#include "formats/mesh/raw_mesh.h"

namespace vps {

/// @param extension  obj, off, ply or stl
/// @throw ReadError, NeedsAssimp (tidy.h), std::bad_alloc
[[nodiscard]] RawMesh read_polygon_soup(const std::string& path, const std::string& extension);

}  // namespace vps

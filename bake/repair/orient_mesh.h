// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Makes neighbouring triangles agree on which side is out. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

/// Turns triangles until as many edges as possible are used equally often in both directions. Of a piece the smaller
/// part is turned. @return number of triangles turned
std::size_t orient_consistently(Mesh& mesh);

}  // namespace vps::bake

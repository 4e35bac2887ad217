// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Makes neighbouring triangles agree on which side is out. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

/// Turns triangles so that edges are used equally often in both directions, as far as a greedy search finds. Within a
/// patch of triangles that share two-sided edges it turns the smaller part. @return number of triangles turned
std::size_t orient_consistently(Mesh& mesh);

}  // namespace vps::bake

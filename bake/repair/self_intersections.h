// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Pairs of triangles that intersect. Internal to bake.
#pragma once

#include <vector>

#include "bake/repair/box_pairs.h"

namespace vps::bake {

/// Finds every pair of triangles that intersect or touch outside their common vertices and edges. Predicates are exact
/// (CGAL). Triangles on the same three vertices are a pair; triangles without area are in no pair.
/// @pre no triangle uses a vertex twice
/// @return sorted pairs, first < second
[[nodiscard]] std::vector<TrianglePair> self_intersections(const Mesh& mesh);

}  // namespace vps::bake

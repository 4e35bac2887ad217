// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Pairs of triangles that intersect. Internal to bake.
#pragma once

#include <utility>
#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

/// Finds every pair of triangles that intersect or touch outside their common vertices and edges. Predicates are exact
/// (CGAL). Triangles on the same three vertices are a pair; triangles without area are in no pair.
/// @pre no triangle uses a vertex twice
/// @return sorted pairs, first < second
[[nodiscard]] std::vector<TrianglePair> self_intersections(const Mesh& mesh);

}  // namespace vps::bake

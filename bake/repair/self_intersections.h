// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Pairs of triangles that meet where they should not. Internal to bake.
#pragma once

#include <utility>
#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

/// Every pair of triangles that meet elsewhere than in their common vertices and edges, touching included, with exact
/// predicates (CGAL). Triangles on the same three vertices are a pair; triangles without area meet nothing.
/// @pre no triangle uses a vertex twice
/// @return sorted pairs, first < second
[[nodiscard]] std::vector<TrianglePair> self_intersections(const Mesh& mesh);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Convex decomposition by HACD, from Bullet's extras. The hulls are kept in a file.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <vector>

#include "formats/triangle_mesh.h"

namespace vps::lab {

using Hull = std::vector<std::array<double, 3>>;  ///< vertices of a convex hull. [m]

struct HacdOptions {
  std::size_t hulls = 8;                ///< [Limits: value > 0]
  std::size_t vertices_per_hull = 100;  ///< at most. [Limits: value > 3]
  double concavity = 100;               ///< limit once `hulls` hulls are left. Units: HACD's, 1000 for the diagonal
  double compacity_weight = 0.1;        ///< as in Bullet's own example
  std::function<void()> announce;       ///< called before it takes minutes; may be empty
};

/// Decomposes a mesh, which takes minutes, or reads the hulls of an earlier run with the same mesh and options.
/// @param folder  keeps the hulls; empty: nothing is kept
/// @throw std::runtime_error when HACD fails or the hulls' bounds differ from the mesh's
[[nodiscard]] std::vector<Hull> hacd_hulls(const TriangleMesh& mesh, const HacdOptions& options,
                                           const std::filesystem::path& folder);

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The peer that decomposes into convex hulls: HACD of Bullet's extras, kept in a file.
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
  double concavity = 100;               ///< at most, once so few hulls are left. Units: HACD's, 1000 for the diagonal
  double compacity_weight = 0.1;        ///< as in Bullet's own example
  std::function<void()> announce;       ///< called before it takes minutes; may be empty
};

/// Decomposes a mesh, which takes minutes, or reads what an earlier run has left in `folder` for the same mesh and
/// options. @param folder  empty: nothing is kept
/// @throw std::runtime_error when HACD fails or its hulls are not where the mesh is
[[nodiscard]] std::vector<Hull> hacd_hulls(const TriangleMesh& mesh, const HacdOptions& options,
                                           const std::filesystem::path& folder);

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How large a mesh is.
#pragma once

#include "bake/stages/creases.h"
#include "formats/triangle_mesh.h"

namespace vps::bake {

/// The facts about a mesh that its grid and the memory of its bake depend on.
struct Extent {
  Vector bounds_min = Vector::Zero();
  Vector bounds_max = Vector::Zero();
  double area = 0;    ///< [m^2]
  double volume = 0;  ///< absolute value; of closed meshes only. [m^3]
  Creases creases;
  std::size_t triangles = 0;
};

/// Measures the vertices that triangles use. Leaves `creases` empty.
/// @throw BakeError when there is no triangle, or an index or coordinate is bad
[[nodiscard]] Extent measure_extent(const TriangleMesh& mesh);

}  // namespace vps::bake

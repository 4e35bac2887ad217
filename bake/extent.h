// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How large a mesh is.
#pragma once

#include "bake/stages/creases.h"
#include "formats/triangle_mesh.h"

namespace vps::bake {

/// What a grid depends on.
struct Extent {
  Vector bounds_min = Vector::Zero();
  Vector bounds_max = Vector::Zero();
  double area = 0;    ///< [m^2]
  double volume = 0;  ///< of closed meshes, without sign. [m^3]
  Creases creases;
  std::size_t triangles = 0;
};

/// Of the vertices that triangles use; without creases. @throw BakeError when there is none or an index or coordinate
/// is bad
[[nodiscard]] Extent measure_extent(const TriangleMesh& mesh);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Length of a mesh's creases. The memory of a bake depends on it and on the area. Internal to bake.
#pragma once

#include "bake/geometry.h"
#include "formats/triangle_mesh.h"

namespace vps::bake {

/// Length of the edges by the angle between the normals of their triangles. Edges of one triangle, or of more than two,
/// count as sharp. Large meshes are estimated from a part of their edges, the same for every run. [m]
struct Creases {
  double blunt = 0;  ///< 11 to 47 degrees
  double sharp = 0;  ///< more
};

/// Edges are joined by the positions of their ends. @pre measure_extent accepts the mesh
[[nodiscard]] Creases measure_creases(const TriangleMesh& mesh);
[[nodiscard]] Creases measure_creases(const Mesh& mesh);

}  // namespace vps::bake

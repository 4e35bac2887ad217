// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Turns imported triangles into a closed, outward surface, or says why that cannot be. Internal to bake.
#pragma once

#include <string>
#include <vector>

#include "bake/geometry.h"
#include "formats/triangle_mesh.h"

namespace vps {

/// Joins identical positions, drops collapsed triangles and unused vertices, rights an inside-out mesh.
/// @param notes  one sentence is added for each thing that was changed
/// @throw BakeError when the mesh is open, inconsistently wound, flat or not finite: with the place of the first fault.
[[nodiscard]] Surface check_mesh(const TriangleMesh& mesh, std::vector<std::string>& notes);

}  // namespace vps

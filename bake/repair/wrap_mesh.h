// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A tight skin around any triangles. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

/// Closed, outward surface without self-intersections around the mesh (CGAL's alpha wrap). Holes narrower than `alpha`
/// are bridged, wider ones are entered. No triangle of the mesh is outside.
/// @param offset  distance that the skin keeps from the mesh. [m]
[[nodiscard]] Mesh wrap_mesh(const Mesh& mesh, double alpha, double offset);

}  // namespace vps::bake

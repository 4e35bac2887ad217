// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Collision of triangles against triangles by FCL, with bounding boxes of type OBBRSS.
#pragma once

#include <memory>

#include "cli/lab/pair.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// Finds all contacts of all pairs of triangles. The depth is that of the deepest pair, not of the bodies.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body);

/// Finds the distance; the answer has none where the bodies overlap.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body);

}  // namespace vps::lab

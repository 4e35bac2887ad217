// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The peer that tests triangles against triangles: FCL, boxes of type OBBRSS.
#pragma once

#include <memory>

#include "cli/lab/pair.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// All contacts of all pairs of triangles. Its depth is that of the deepest pair, not of the bodies.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body);

/// Distance; tells none where the bodies overlap.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body);

}  // namespace vps::lab

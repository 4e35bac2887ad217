// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The peer of the query benchmark that tests triangles against triangles: FCL, boxes of type OBBRSS.
#pragma once

#include <memory>

#include "formats/triangle_mesh.h"
#include "tests/bench/query_pair.h"

namespace vps::bench {

/// All contacts of all pairs of triangles. Tells no depth: FCL's is that of a pair of triangles.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body);

/// Distance; tells none where the bodies overlap.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body);

}  // namespace vps::bench

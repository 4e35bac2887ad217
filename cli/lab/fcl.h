// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Collision of triangles against triangles by FCL, with bounding boxes of type OBBRSS.
#pragma once

#include <cstddef>
#include <memory>

#include "cli/lab/pair.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// Finds all contacts of all pairs of triangles. The depth is that of the deepest pair, not of the bodies.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body);

/// Finds the distance; the answer has none where the bodies overlap.
[[nodiscard]] std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body);

struct CountedDistance {
  double distance = 0;    ///< 0 where the bodies overlap; too large where the limit ended the query. [m]
  std::size_t tests = 0;  ///< tests of a pair of boxes
};

/// The distance of `fcl_distance` with a limit on its work. It takes a few milliseconds as a rule, but 0.1 s and more
/// for long thin bodies, whose boxes overlap without contact.
class LimitedDistance {
 public:
  explicit LimitedDistance(const TriangleMesh& body);
  ~LimitedDistance();
  /// @param most_tests  the query ends after so many tests of a pair of boxes. [Limits: value > 0]
  [[nodiscard]] CountedDistance query(const Pose& first_in_second, std::size_t most_tests) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vps::lab

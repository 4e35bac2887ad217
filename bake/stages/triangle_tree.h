// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Distances of many points from the surface, in float. Vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "bake/stages/float_distances.h"
#include "bake/unset_vector.h"

namespace vps::bake {

/// A tree of boxes with 16 children each. Its leaves hold 16 triangles.
class TriangleTree {
 public:
  /// @param reach  points may lie this far from the surface's bounds, along each axis. [m]
  TriangleTree(const Surface& surface, double reach);

  /// The distance from the surface or `at_most`, whichever is less. Safe from several threads. [m]
  [[nodiscard]] double distance(const Vector& point, double at_most = std::numeric_limits<double>::infinity()) const;
  /// Appends the triangles that are no farther than `reach`, and perhaps some that are farther by twice the error.
  void find_within(const Vector& point, double reach, std::vector<std::uint32_t>& triangles) const;
  [[nodiscard]] double error() const { return error_; }  ///< bound of the distances' error. [m]

  /// The children of a node, or the triangles of a leaf.
  static constexpr std::size_t kWidth = 16;
  struct alignas(64) Node {
    // Empty boxes lie infinitely far away.
    float low[3][kWidth];
    float high[3][kWidth];
    std::array<std::uint32_t, kWidth> child;  // numbers of nodes, or of leaves + kLeaf
  };
  struct alignas(64) Leaf {
    float linear[7][4][kWidth];  // height, along and outward of `FloatTriangle`
    float length[3][kWidth];
  };
  static constexpr std::uint32_t kLeaf = 0x80000000u;

 private:
  Vector centre_ = Vector::Zero();
  double error_ = 0;
  std::vector<std::uint32_t> order_;  // triangles of the leaves, 16 each
  std::vector<Node> nodes_;           // the root last
  UnsetVector<Leaf> leaves_;
};

}  // namespace vps::bake

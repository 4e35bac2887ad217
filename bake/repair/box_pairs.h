// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Pairs of triangles whose boxes overlap, by a tree of boxes in float. Vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "bake/geometry.h"

namespace vps::bake {

using TrianglePair = std::pair<std::uint32_t, std::uint32_t>;

/// A search in parts that do not depend on each other. Triangles whose boxes overlap or touch are a pair of exactly one
/// part; so may be triangles whose boxes are as near as rounding to float.
class BoxPairs {
 public:
  explicit BoxPairs(const Mesh& mesh);

  [[nodiscard]] std::size_t parts() const { return levels_.empty() ? 0 : levels_.front().size(); }
  /// Appends a part's pairs, first < second, in no order. Safe from several threads.
  void find(std::size_t part, std::vector<TrianglePair>& pairs) const;

  /// Boxes of a node's children, or of a leaf's triangles. Empty ones overlap none.
  static constexpr std::size_t kWidth = 16;
  struct alignas(64) Node {
    float low[3][kWidth];
    float high[3][kWidth];
  };

 private:
  std::vector<std::uint32_t> order_;       // of triangles, along a curve
  std::vector<std::vector<Node>> levels_;  // leaves first, the root last; each node is over 16 of the level before
};

}  // namespace vps::bake

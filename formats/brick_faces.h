// SPDX-License-Identifier: Zlib
/// @file Values of field bricks on their common faces. docs/internals/bounds.md, "Faces between bricks".
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "formats/octree.h"

namespace vps::octree {

/// Places are counted in cells of the finest level, from the centre of voxel (0,0,0).
inline constexpr std::int64_t kPlacesPerVoxel = std::int64_t{1} << -kFinestLevel;
using Place = std::array<std::int64_t, 3>;

/// The octree of a field, as it is stored.
struct Octree {
  const std::uint32_t* roots;
  const std::uint32_t* nodes;
  const std::uint32_t* root_dims;

  [[nodiscard]] std::size_t root_count() const noexcept {
    return std::size_t{root_dims[0]} * root_dims[1] * root_dims[2];
  }
};

/// Distance of a brick's samples. [Units: places]
inline std::int64_t spacing_of(std::uint32_t entry) noexcept {
  return std::int64_t{1} << (level_of(entry) - kFinestLevel);
}

/// V that a brick interpolates at a place of a cell that its entry covers, faces included.
/// @param sample  V of a sample, from the entry of its brick and its number among all samples
template <class Sample>
double interpolate(std::uint32_t entry, const std::uint32_t (&cell)[3], const Place& place, const Sample& sample) {
  const int shift = level_of(entry) - kFinestLevel;  // of places to samples
  constexpr int kCells = 2;                          // of samples to bricks
  static_assert(kFieldEdge - 1 == 1 << kCells);
  std::int64_t at[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    at[axis] = place[axis] - (kPlacesPerVoxel * cell[axis] >> (shift + kCells) << (shift + kCells));
  }
  const auto number = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    return sample_at(entry, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y),
                     static_cast<std::uint32_t>(z));
  };
  const std::int64_t spacing = std::int64_t{1} << shift;
  if (((at[0] | at[1] | at[2]) & (spacing - 1)) == 0) {
    return sample(entry, number(at[0] >> shift, at[1] >> shift, at[2] >> shift));
  }
  std::int64_t low[3];
  double weights[3][2];
  std::uint32_t between = 0;  // axes along which the place lies between samples
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    low[axis] = at[axis] >> shift;
    weights[axis][1] = static_cast<double>(at[axis] & (spacing - 1)) / static_cast<double>(spacing);
    weights[axis][0] = 1 - weights[axis][1];
    if (weights[axis][1] > 0) between |= 1U << axis;
  }
  double sum = 0;
  for (std::uint32_t corner = 0, left = 1U << std::popcount(between); left > 0; --left) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    const double weight = weights[0][d[0]] * weights[1][d[1]] * weights[2][d[2]];
    sum += weight * sample(entry, number(low[0] + d[0], low[1] + d[1], low[2] + d[2]));
    corner = (corner - between) & between;  // the next corner that differs along these axes only
  }
  return sum;
}

/// Whether two cubes lie in one brick. Equal bricks share their samples, so an entry alone does not tell.
inline bool are_in_one_brick(std::uint32_t entry, const std::uint32_t (&cell)[3], std::uint32_t other,
                             const std::uint32_t (&other_cell)[3]) noexcept {
  const auto brick = [&](std::uint32_t at) { return kPlacesPerVoxel * at / ((kFieldEdge - 1) * spacing_of(entry)); };
  return entry == other && brick(cell[0]) == brick(other_cell[0]) && brick(cell[1]) == brick(other_cell[1]) &&
         brick(cell[2]) == brick(other_cell[2]);
}

/// Calls visit(entry, cell, edge) for each entry under a root that leads to a brick: its lowest cell and its edge, in
/// cells of level 0.
/// @param root  [Limits: value < root_count]
template <class Visit>
void for_each_brick_entry(const Octree& tree, std::size_t root, const Visit& visit) {
  const auto walk = [&](auto&& self, std::uint32_t entry, const std::uint32_t(&cell)[3], std::uint32_t edge) -> void {
    if (is_brick(entry)) return visit(entry, cell, edge);
    if (!is_node(entry) || edge == 1) return;
    const std::uint32_t half = edge / 2;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      self(self, tree.nodes[8 * std::size_t{node_of(entry)} + octant],
           {cell[0] + half * (octant & 1), cell[1] + half * (octant >> 1 & 1), cell[2] + half * (octant >> 2)}, half);
    }
  };
  const std::size_t row = root / tree.root_dims[0];
  const auto at = [](std::size_t n) { return kRootCells * static_cast<std::uint32_t>(n); };
  walk(walk, root_entry(tree.roots[root]),
       {at(root % tree.root_dims[0]), at(row % tree.root_dims[1]), at(row / tree.root_dims[1])}, kRootCells);
}

/// Calls visit(place, here, there) on every face between a brick under a root and another brick: V of both. The places
/// are the samples of the finer one and the corners of the face. Between them the difference is bilinear, so that it is
/// largest at one of them. The roots together have each face once.
/// @param root    [Limits: value < root_count]
/// @param sample  see interpolate
template <class Sample, class Visit>
void for_each_sample_on_faces(const Octree& tree, std::size_t root, const Sample& sample, const Visit& visit) {
  for_each_brick_entry(tree, root, [&](std::uint32_t entry, const std::uint32_t(&cell)[3], std::uint32_t edge) {
    for (std::size_t face = 0; face < 6; ++face) {
      const std::size_t axis = face / 2;
      const bool upper = face % 2 != 0;
      const std::int64_t behind = std::int64_t{cell[axis]} + (upper ? std::int64_t{edge} : -1);
      if (behind < 0 || behind >= std::int64_t{tree.root_dims[axis]} * kRootCells) continue;
      std::uint32_t other_cell[3] = {cell[0], cell[1], cell[2]};
      other_cell[axis] = static_cast<std::uint32_t>(behind);
      const Found other = find_entry(tree.roots, tree.nodes, tree.root_dims, other_cell);
      // The smaller cube has the whole face; of equal ones, the lower has it.
      if (other.edge < edge || (other.edge == edge && !upper)) continue;
      if (!is_brick(other.entry) || are_in_one_brick(entry, cell, other.entry, other_cell)) continue;
      const std::int64_t length = kPlacesPerVoxel * edge;
      const std::int64_t step = std::min({spacing_of(entry), spacing_of(other.entry), length});
      Place place;
      place[axis] = kPlacesPerVoxel * (std::int64_t{cell[axis]} + (upper ? edge : 0));
      const std::size_t u = (axis + 1) % 3;
      const std::size_t v = (axis + 2) % 3;
      for (std::int64_t y = 0; y <= length; y += step) {
        place[v] = kPlacesPerVoxel * cell[v] + y;
        for (std::int64_t x = 0; x <= length; x += step) {
          place[u] = kPlacesPerVoxel * cell[u] + x;
          visit(place, interpolate(entry, cell, place, sample), interpolate(other.entry, other_cell, place, sample));
        }
      }
    }
  });
}

}  // namespace vps::octree

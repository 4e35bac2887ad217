// SPDX-License-Identifier: Zlib
/// @file The octree of a sampled field: the meaning of its entries, and the look-up of a cell's entry.
/// docs/internals/format.md, "The sampled field".
///
/// A field is sampled in bricks of 4x4x4 cells whose edge is s 2^level. Cells are counted from the centre of voxel
/// (0,0,0), at every level; a brick's lowest cell is (4 i, 4 j, 4 k) of its level. The octree finds the brick over a
/// cell of level 0. Its roots are blocks of 16x16x16 such cells, and each node has eight entries, one for each octant,
/// x fastest.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vps {

/// Cells of level 0 along the edge of an octree's root.
inline constexpr std::uint32_t kRootCells = 16;
/// Samples along the edge of a field brick, both ends included. Neighbours repeat the samples on their common face.
inline constexpr std::uint32_t kFieldEdge = 5;
/// Stored samples per field brick: sample (x,y,z) is number (5 z + y) 5 + x; the last three are padding.
inline constexpr std::uint32_t kFieldStride = 128;
/// Levels of field bricks: cells of s/4 to 2 s.
inline constexpr int kFinestLevel = -2;
inline constexpr int kCoarsestLevel = 1;
/// Entries of `field_roots` and `field_nodes` that mean no brick: beyond the band, outside or inside the solid.
inline constexpr std::uint32_t kFarOutside = 0xFFFFFFFFu;
inline constexpr std::uint32_t kFarInside = 0xFFFFFFFEu;
/// Any other entry is `kNodeFlag` + the number of a node, or the number of a field brick + (its level - kFinestLevel)
/// shifted left by kLevelShift. Several entries may lead to one brick.
inline constexpr std::uint32_t kNodeFlag = 0x80000000u;
/// No brick is as large as a block of `field_roots`. Where such an entry is less than kNodeFlag, the block has no
/// samples, and kInsideFlag tells whether it lies inside. With kOctantsFlag the other bits number its planes, one for
/// each octant; without, they are its plane (formats/cell_plane.h).
inline constexpr std::uint32_t kInsideFlag = 0x40000000u;
inline constexpr std::uint32_t kOctantsFlag = 0x20000000u;
inline constexpr int kLevelShift = 28;
inline constexpr std::uint32_t kNumberMask = (1u << kLevelShift) - 1;

namespace octree {

[[nodiscard]] constexpr bool is_brick(std::uint32_t entry) noexcept {
  return entry < kNodeFlag;
}
[[nodiscard]] constexpr bool is_node(std::uint32_t entry) noexcept {
  return entry >= kNodeFlag && entry < kFarInside;
}
/// An entry of `field_roots` without its plane.
[[nodiscard]] constexpr std::uint32_t root_entry(std::uint32_t root) noexcept {
  if (root >= kNodeFlag) return root;
  return (root & kInsideFlag) != 0 ? kFarInside : kFarOutside;
}
/// Whether each octant of a root has a plane, in a field with planes.
[[nodiscard]] constexpr bool has_octant_planes(std::uint32_t root) noexcept {
  return (root & (kNodeFlag | kOctantsFlag)) != 0;
}
/// Number of these planes; of a node its own. @pre has_octant_planes(root), and the root is no far one
[[nodiscard]] constexpr std::uint32_t planes_of(std::uint32_t root) noexcept {
  return root & ~(kNodeFlag | kInsideFlag | kOctantsFlag);
}
/// Number of a node. @pre is_node(entry)
[[nodiscard]] constexpr std::uint32_t node_of(std::uint32_t entry) noexcept {
  return entry & ~kNodeFlag;
}
/// Number of a field brick. @pre is_brick(entry), as below
[[nodiscard]] constexpr std::uint32_t brick_of(std::uint32_t entry) noexcept {
  return entry & kNumberMask;
}
/// Level of a field brick. [Limits: kFinestLevel <= value <= kCoarsestLevel in an asset that was checked]
[[nodiscard]] constexpr int level_of(std::uint32_t entry) noexcept {
  return static_cast<int>(entry >> kLevelShift) + kFinestLevel;
}
/// Number of a brick's first sample among all samples of its field.
[[nodiscard]] constexpr std::size_t first_sample(std::uint32_t entry) noexcept {
  return std::size_t{brick_of(entry)} * kFieldStride;
}
/// Number of sample (x, y, z) in its brick.
[[nodiscard]] constexpr std::uint32_t sample_in_brick(std::uint32_t x, std::uint32_t y, std::uint32_t z) noexcept {
  return (z * kFieldEdge + y) * kFieldEdge + x;
}

/// @param node  [Limits: value < kNumberMask]
[[nodiscard]] constexpr std::uint32_t node_entry(std::uint32_t node) noexcept {
  return kNodeFlag | node;
}
/// @param brick  [Limits: value <= kNumberMask]
[[nodiscard]] constexpr std::uint32_t brick_entry(std::uint32_t brick, int level) noexcept {
  return brick | static_cast<std::uint32_t>(level - kFinestLevel) << kLevelShift;
}

/// Result of a look-up.
struct Found {
  std::uint32_t entry = kFarOutside;  ///< a brick's entry, or one that means no brick
  std::uint32_t edge = kRootCells;    ///< of the entry's cube, in cells of level 0
};

/// Walks down to the entry that covers a cell of level 0.
/// @param roots      x fastest
/// @param root_dims  roots along x and y
/// @param cell       inside the roots
[[nodiscard]] inline Found find_entry(const std::uint32_t* roots, const std::uint32_t* nodes,
                                      const std::uint32_t* root_dims, const std::uint32_t (&cell)[3]) noexcept {
  const std::size_t root =
      (std::size_t{cell[2] / kRootCells} * root_dims[1] + cell[1] / kRootCells) * root_dims[0] + cell[0] / kRootCells;
  Found found;
  found.entry = root_entry(roots[root]);
  while (found.edge > 1 && is_node(found.entry)) {
    found.edge /= 2;
    const std::uint32_t octant =
        (cell[2] / found.edge % 2) * 4 + (cell[1] / found.edge % 2) * 2 + cell[0] / found.edge % 2;
    found.entry = nodes[8 * std::size_t{node_of(found.entry)} + octant];
  }
  return found;
}

}  // namespace octree
}  // namespace vps

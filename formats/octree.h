// SPDX-License-Identifier: Zlib
/// @file The octree of a sampled field: the meaning of its entries, and the look-up of a cell's entry.
/// docs/internals/format.md, "The sampled field".
///
/// A field is sampled in bricks of 4x4x4 cells whose edge is s 2^level. Cells are counted from the centre of voxel
/// (0,0,0), at every level; a brick's lowest cell is (4 i, 4 j, 4 k) of its level. The octree finds the brick over a
/// cell of level 0. Its roots are blocks of 16x16x16 such cells, and each node has eight entries, one for each octant,
/// x fastest.
///
/// A brick is stored as slices of 5x5 samples. A slice at either end that equals the one next to it may be left out.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace vps {

/// Cells of level 0 along the edge of an octree's root.
inline constexpr std::uint32_t kRootCells = 16;
/// Samples along the edge of a field brick, both ends included. Neighbours repeat the samples on their common face.
inline constexpr std::uint32_t kFieldEdge = 5;
/// Samples of a slice of a brick.
inline constexpr std::uint32_t kFieldSlice = kFieldEdge * kFieldEdge;
/// Samples of a brick of which no slice is left out.
inline constexpr std::uint32_t kFieldSamples = kFieldEdge * kFieldSlice;
/// Levels of field bricks: cells of s/4 to 2 s.
inline constexpr int kFinestLevel = -2;
inline constexpr int kCoarsestLevel = 1;
/// Entries of `field_roots` and `field_nodes` that mean no brick: beyond the band, outside or inside the solid.
inline constexpr std::uint32_t kFarOutside = 0xFFFFFFFFu;
inline constexpr std::uint32_t kFarInside = 0xFFFFFFFEu;
/// Any other entry is `kNodeFlag` + the number of a node, or that of a field brick. Several entries may lead to one
/// brick. Its bits, from the lowest:
/// - 24: number of the brick's first slice among all slices of the field
/// - 2: how many slices are left out
/// - 1: at which end; 1: the lower one
/// - 2: the axis along which the slices follow each other; 0: z, 1: y, 2: x
/// - 2: the brick's level - kFinestLevel
inline constexpr std::uint32_t kNodeFlag = 0x80000000u;
/// No brick is as large as a block of `field_roots`. Where such an entry is less than kNodeFlag, the block has no
/// samples, and kInsideFlag tells whether it lies inside. With kOctantsFlag the other bits number its planes, one for
/// each octant; without, they are its plane (formats/cell_plane.h).
inline constexpr std::uint32_t kInsideFlag = 0x40000000u;
inline constexpr std::uint32_t kOctantsFlag = 0x20000000u;
inline constexpr int kLeftOutShift = 24;
inline constexpr int kLowerEndShift = 26;
inline constexpr int kAxisShift = 27;
inline constexpr int kLevelShift = 29;
inline constexpr std::uint32_t kNumberMask = (1u << kLeftOutShift) - 1;
/// Most slices of a field, and most nodes of its octree.
inline constexpr std::uint32_t kMostSlices = kNumberMask;
inline constexpr std::uint32_t kMostNodes = (1u << 28) - 1;

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
/// Number of a field brick's first slice. @pre is_brick(entry), as below
[[nodiscard]] constexpr std::uint32_t slice_of(std::uint32_t entry) noexcept {
  return entry & kNumberMask;
}
/// Level of a field brick. [Limits: kFinestLevel <= value <= kCoarsestLevel]
[[nodiscard]] constexpr int level_of(std::uint32_t entry) noexcept {
  return static_cast<int>(entry >> kLevelShift) + kFinestLevel;
}

/// The slices of a field brick that are stored.
struct Slices {
  std::uint32_t axis = 2;            ///< that they follow each other along; in a slice, z takes its place
  std::uint32_t first = 0;           ///< 0, or kFieldEdge - count
  std::uint32_t count = kFieldEdge;  ///< [Limits: 2 <= value <= kFieldEdge]
};
/// [Limits: axis <= 2 in an asset that was checked]
[[nodiscard]] constexpr Slices slices_of(std::uint32_t entry) noexcept {
  const std::uint32_t left_out = entry >> kLeftOutShift & 3;
  return {2 - (entry >> kAxisShift & 3), (entry >> kLowerEndShift & 1) * left_out, kFieldEdge - left_out};
}

/// A cell's corners among all samples of the field.
struct Corners {
  std::size_t first = 0;    ///< number of the lowest
  std::uint32_t step[3]{};  ///< to the next along x, y, z; 0 in a cell of slices that are left out
  /// @param corner  x fastest. [Limits: value < 8]
  [[nodiscard]] constexpr std::size_t number(std::size_t corner) const noexcept {
    return first + (corner & 1) * step[0] + (corner >> 1 & 1) * step[1] + (corner >> 2) * step[2];
  }
};
/// @param at  the cell's lowest sample in its brick. [Limits: value < kFieldEdge]
[[nodiscard]] constexpr Corners corners_of(std::uint32_t entry, const std::uint32_t (&at)[3]) noexcept {
  const Slices slices = slices_of(entry);
  std::uint32_t sample[3] = {at[0], at[1], at[2]};
  std::swap(sample[slices.axis], sample[2]);
  const auto stored = [&](std::uint32_t slice) {
    return std::clamp(slice, slices.first, slices.first + slices.count - 1) - slices.first;
  };
  const std::uint32_t low = stored(sample[2]);
  const std::size_t slice = std::size_t{slice_of(entry)} + low;
  Corners corners{(slice * kFieldEdge + sample[1]) * kFieldEdge + sample[0],
                  {1, kFieldEdge, kFieldSlice * (stored(sample[2] + 1) - low)}};
  std::swap(corners.step[slices.axis], corners.step[2]);
  return corners;
}
/// Number of a brick's sample (x, y, z) among all samples of the field.
[[nodiscard]] constexpr std::size_t sample_at(std::uint32_t entry, std::uint32_t x, std::uint32_t y,
                                              std::uint32_t z) noexcept {
  return corners_of(entry, {x, y, z}).first;
}

/// @param node  [Limits: value < kMostNodes]
[[nodiscard]] constexpr std::uint32_t node_entry(std::uint32_t node) noexcept {
  return kNodeFlag | node;
}
/// @param slice  number of the brick's first slice. [Limits: value < kMostSlices]
[[nodiscard]] constexpr std::uint32_t brick_entry(std::uint32_t slice, int level, const Slices& slices = {}) noexcept {
  return slice | (kFieldEdge - slices.count) << kLeftOutShift | (slices.first > 0 ? 1u : 0u) << kLowerEndShift |
         (2 - slices.axis) << kAxisShift | static_cast<std::uint32_t>(level - kFinestLevel) << kLevelShift;
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

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The voxel grid and sparse sets of its bricks. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bake/geometry.h"
#include "formats/vps_format.h"

namespace vps::bake {

using Index3 = std::array<std::uint32_t, 3>;

/// Regular grid of cubic voxels. Voxel (i,j,k) spans origin + s * [i, i+1] and so on.
struct Grid {
  Index3 dims{};        ///< [vx], multiples of kBrickEdge
  Index3 brick_dims{};  ///< bricks
  Vector origin = Vector::Zero();
  double voxel_size = 0;  ///< s. [m]

  [[nodiscard]] Vector centre(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return origin + voxel_size * Vector(i + 0.5, j + 0.5, k + 0.5);
  }
  /// Centre of a voxel given by its brick and its position inside it.
  [[nodiscard]] Vector centre(const Index3& brick, std::uint32_t voxel) const {
    return centre(brick[0] * kBrickEdge + voxel % kBrickEdge, brick[1] * kBrickEdge + voxel / kBrickEdge % kBrickEdge,
                  brick[2] * kBrickEdge + voxel / (kBrickEdge * kBrickEdge));
  }
  [[nodiscard]] std::size_t brick_count() const { return std::size_t{brick_dims[0]} * brick_dims[1] * brick_dims[2]; }
  [[nodiscard]] std::size_t brick_at(std::uint32_t x, std::uint32_t y, std::uint32_t z) const {
    return (std::size_t{z} * brick_dims[1] + y) * brick_dims[0] + x;
  }
  [[nodiscard]] std::size_t brick_of_voxel(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return brick_at(i / kBrickEdge, j / kBrickEdge, k / kBrickEdge);
  }
};

/// Position of a voxel inside its brick, x fastest.
inline std::uint32_t voxel_in_brick(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
  return ((k % kBrickEdge) * kBrickEdge + j % kBrickEdge) * kBrickEdge + i % kBrickEdge;
}

/// Some bricks of a grid, numbered in scan order (x fastest).
struct BrickSet {
  std::vector<std::uint32_t> index;  ///< for each brick of the grid, its number in the set or kNoBrick
  std::vector<Index3> bricks;        ///< position in the grid of each numbered brick

  /// @param chosen  one byte per brick of the grid, non-zero to take it
  static BrickSet from_flags(const Grid& grid, const std::vector<std::uint8_t>& chosen) {
    BrickSet set;
    set.index.assign(grid.brick_count(), kNoBrick);
    std::size_t at = 0;
    for (std::uint32_t z = 0; z < grid.brick_dims[2]; ++z) {
      for (std::uint32_t y = 0; y < grid.brick_dims[1]; ++y) {
        for (std::uint32_t x = 0; x < grid.brick_dims[0]; ++x, ++at) {
          if (chosen[at] == 0) continue;
          set.index[at] = static_cast<std::uint32_t>(set.bricks.size());
          set.bricks.push_back({x, y, z});
        }
      }
    }
    return set;
  }
};

/// One bit per voxel of a brick: word z, bit 8 y + x.
using BrickMask = std::array<std::uint64_t, kBrickEdge>;

inline bool test_bit(const BrickMask& mask, std::uint32_t voxel) {
  return (mask[voxel / 64] >> (voxel % 64)) & 1;
}
/// std::popcount without a call: only later processors have an instruction for it.
inline std::uint64_t count_bits(std::uint64_t bits) {
  bits -= bits >> 1 & 0x5555555555555555;
  bits = (bits & 0x3333333333333333) + (bits >> 2 & 0x3333333333333333);
  return ((bits + (bits >> 4)) & 0x0F0F0F0F0F0F0F0F) * 0x0101010101010101 >> 56;
}
inline void set_bit(BrickMask& mask, std::uint32_t voxel) {
  mask[voxel / 64] |= std::uint64_t{1} << (voxel % 64);
}

}  // namespace vps::bake

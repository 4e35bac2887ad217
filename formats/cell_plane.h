// SPDX-License-Identifier: Zlib
/// @file The code of a linear upper bound of V in a cell of 8x8x8 voxels, or in a block of 16x16x16: 32 bits. Encoded
/// by the bake, decoded by queries. docs/internals/format.md, "The planes". Decoders accept any code.
#pragma once

#include <cstdint>

namespace vps {

/// Edge of a cell with a plane. Cell (i, j, k) begins at the centre of voxel (8 i, 8 j, 8 k). [vx]
inline constexpr int kPlaneCell = 8;
/// Steps of a gradient in 1.
inline constexpr int kSlopeSteps = 60;
/// A height's code is the root of its size times this, with its sign: near the surface heights have small steps.
inline constexpr int kHeightSquares = 4096;
/// Largest code of a slope, and of a height.
inline constexpr int kLargestSlope = 63;
inline constexpr int kLargestHeight = 511;

/// V <= height |height| / kHeightSquares + sum of slope / kSlopeSteps (P - centre of the cell), in voxels.
struct CellPlane {
  int slope[3] = {};  ///< [Limits: -kLargestSlope <= value <= kLargestSlope]
  int height = 0;     ///< [Limits: -kLargestHeight <= value <= kLargestHeight]
  bool wide = false;  ///< it also bounds the field's own values up to a voxel around the cell
};

/// Bits 0 to 20 are the slopes along x, y and z, 21 to 30 the height, all in two's complement; bit 31 is `wide`.
[[nodiscard]] constexpr std::uint32_t encode(const CellPlane& plane) noexcept {
  const auto bits = [](int value, int count) { return static_cast<std::uint32_t>(value) & ((1U << count) - 1); };
  return bits(plane.slope[0], 7) | bits(plane.slope[1], 7) << 7 | bits(plane.slope[2], 7) << 14 |
         bits(plane.height, 10) << 21 | static_cast<std::uint32_t>(plane.wide) << 31;
}
[[nodiscard]] constexpr CellPlane decode_plane(std::uint32_t code) noexcept {
  const auto part = [&](int first, int count) {
    return static_cast<std::int32_t>(code << (32 - first - count)) >> (32 - count);
  };
  return {{part(0, 7), part(7, 7), part(14, 7)}, part(21, 10), code >> 31 != 0};
}

/// Heights of blocks are coded in four times the step of those of cells.
inline constexpr int kLargestBlockHeight = 4 * 127;

/// The entry of `field_roots` of a block without samples: bits 0 to 20 as above, 21 to 28 the height, bit 30 whether
/// the block lies inside. A height is rounded up. @pre |height| <= kLargestBlockHeight; not wide
[[nodiscard]] constexpr std::uint32_t encode_block(const CellPlane& plane, bool inside) noexcept {
  const auto height = static_cast<std::uint32_t>((plane.height + 3) >> 2) & 255U;
  return (encode(plane) & ((1U << 21) - 1)) | height << 21 | static_cast<std::uint32_t>(inside) << 30;
}
[[nodiscard]] constexpr CellPlane decode_block(std::uint32_t code) noexcept {
  CellPlane plane = decode_plane(code);
  plane.height = 4 * (static_cast<std::int32_t>(code << 3) >> 24);
  plane.wide = false;
  return plane;
}

/// [vx]
[[nodiscard]] constexpr float plane_height(int code) noexcept {
  return static_cast<float>(code * (code < 0 ? -code : code)) * (1.0F / kHeightSquares);
}

/// The bound at a point. [vx]
/// @param from_centre  of the cell or block. [vx]
[[nodiscard]] constexpr float height_at(const CellPlane& plane, const float (&from_centre)[3]) noexcept {
  float rise = 0;
  for (int axis = 0; axis < 3; ++axis) rise += static_cast<float>(plane.slope[axis]) * from_centre[axis];
  return rise / kSlopeSteps + plane_height(plane.height);
}

}  // namespace vps

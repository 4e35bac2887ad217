// SPDX-License-Identifier: Zlib
/// @file Look-ups in a voxelmap's far grid. Internal. docs/internals/format.md, "The far grid".
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps::detail {

inline float mix(float a, float b, float part) noexcept {
  return a + part * (b - a);
}

/// Trilinear interpolation between the corners of a cell, x fastest.
/// @param part  place in the cell, [0, 1] along x, y, z
inline float trilinear(const float (&v)[8], const float (&part)[3]) noexcept {
  const float y0 = mix(mix(v[0], v[1], part[0]), mix(v[2], v[3], part[0]), part[1]);
  const float y1 = mix(mix(v[4], v[5], part[0]), mix(v[6], v[7], part[0]), part[1]);
  return mix(y0, y1, part[2]);
}

/// Minus the gradient of the trilinear interpolation in a cell of edge `edge`.
inline Vec3 trilinear_fall(const float (&v)[8], const float (&part)[3], float edge) noexcept {
  float out[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t step = std::size_t{1} << axis;
    const std::size_t a = (axis + 1) % 3;
    const std::size_t b = (axis + 2) % 3;
    const auto rise = [&](std::size_t along_a, std::size_t along_b) {
      const std::size_t low = along_a << a | along_b << b;
      return v[low | step] - v[low];
    };
    out[axis] = -mix(mix(rise(0, 0), rise(1, 0), part[a]), mix(rise(0, 1), rise(1, 1), part[a]), part[b]) / edge;
  }
  return {out[0], out[1], out[2]};
}

/// The cell of the far grid at a point.
struct FarCell {
  bool in_grid = false;
  float corners[8] = {};  ///< [m]
  float part[3] = {};     ///< [0, 1] along x, y, z
};

inline FarCell find_far_cell(const FarGridView& far, Vec3 point) noexcept {
  FarCell cell;
  if (far.values == nullptr) return cell;
  const float p[3] = {point.x, point.y, point.z};
  std::size_t low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float at = static_cast<float>(p[axis] - far.origin[axis]) / far.spacing;
    // Written so that NaN counts as beyond the grid.
    if (!(at >= 0 && at < static_cast<float>(far.dims[axis] - 1))) return cell;
    low[axis] = static_cast<std::size_t>(at);
    cell.part[axis] = at - static_cast<float>(low[axis]);
  }
  cell.in_grid = true;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t y = low[1] + (corner >> 1 & 1);
    const std::size_t z = low[2] + (corner >> 2);
    const float v = far.values[(z * far.dims[1] + y) * far.dims[0] + low[0] + (corner & 1)];
    cell.corners[corner] = v * (v > 0 ? far.step_inner : far.step_outer);
  }
  return cell;
}

inline float far_value(const FarCell& cell) noexcept {
  return trilinear(cell.corners, cell.part);
}

/// V of nodes that are clamped: they may lie farther outside. [m]
inline float farthest_value(const FarGridView& far) noexcept {
  return -kLargestFarValue * far.step_outer;
}

}  // namespace vps::detail

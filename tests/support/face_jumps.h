// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Jumps of an asset's field at the faces between field bricks, for tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "tests/support/field_samples.h"

namespace vps::test {

/// What the brick of an entry interpolates at a point of its cube, faces included. [m]
/// @param quarters  the point, in quarter voxels from the centre of voxel (0,0,0)
/// @param cell      a cell of level 0 in the entry's cube
inline double interpolate_in(const VoxelmapView& map, std::uint32_t entry, const std::array<std::int64_t, 3>& quarters,
                             const std::uint32_t (&cell)[3]) {
  const int level = octree::level_of(entry);
  const double step = std::ldexp(4.0, level);
  const double edge = step * (kFieldEdge - 1);
  double part[3];
  std::uint32_t low[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double base = std::floor(4.0 * cell[axis] / edge) * edge;
    const double at = (static_cast<double>(quarters[axis]) - base) / step;
    low[axis] = static_cast<std::uint32_t>(std::min(at, kFieldEdge - 2.0));
    part[axis] = at - low[axis];
  }
  double sum = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? part[axis] : 1 - part[axis];
    const std::size_t n =
        octree::first_sample(entry) + octree::sample_in_brick(low[0] + d[0], low[1] + d[1], low[2] + d[2]);
    double value = 0;
    if (map.field == Field::real) {
      value = static_cast<const double*>(map.values)[n];
    } else {
      const double code = map.element == ElementType::i8 ? static_cast<const std::int8_t*>(map.values)[n]
                                                         : static_cast<const std::int16_t*>(map.values)[n];
      value = code * map.lambda * (level > 0 ? 2 : 1);
    }
    sum += weight * value;
  }
  return sum;
}

/// Calls visit(V, jump) for every sample on a face of its brick. V is the brick's own value. The jump is how far the
/// values of bricks that meet there are apart; between samples it is no larger, as the difference of two bricks on a
/// face is bilinear between the finer one's samples. [m]
/// @param voxel_size  from AssetInfo
template <class Visit>
void for_each_face_jump(const VoxelmapView& map, double voxel_size, Visit visit) {
  for_each_sample(map, voxel_size, [&](std::size_t, const std::array<double, 3>& place, int) {
    std::array<std::int64_t, 3> quarters;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      quarters[axis] = std::llround(4 * ((place[axis] - map.origin[axis]) / voxel_size - 0.5));
    }
    double low = 0;
    double high = 0;
    int bricks = 0;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      std::uint32_t cell[3];
      bool is_cell = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::int64_t below = (corner >> axis) & 1;
        const std::int64_t at = quarters[axis] / 4 - below;
        is_cell = is_cell && (below == 0 || quarters[axis] % 4 == 0) && at >= 0 &&
                  at < std::int64_t{map.root_dims[axis]} * kRootCells;
        cell[axis] = static_cast<std::uint32_t>(at);
      }
      if (!is_cell) continue;
      const std::uint32_t entry = octree::find_entry(map.field_roots, map.field_nodes, map.root_dims, cell).entry;
      if (!octree::is_brick(entry)) continue;
      const double v = interpolate_in(map, entry, quarters, cell);
      low = bricks == 0 ? v : std::min(low, v);
      high = bricks == 0 ? v : std::max(high, v);
      ++bricks;
    }
    if (bricks > 1) visit((low + high) / 2, high - low);
  });
}

}  // namespace vps::test

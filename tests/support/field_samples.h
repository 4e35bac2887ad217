// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Visits the samples of an asset's field through its octree, for tests.
#pragma once

#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "runtime/vps_runtime.h"

namespace vps::test {

/// Calls visit(sample's number, its position, its brick's level) once for every stored sample of every field brick.
/// Equal bricks share samples: each has its own positions.
/// @param voxel_size  from AssetInfo, as the view holds it only as float
template <class Visit>
void for_each_sample(const VoxelmapView& map, double voxel_size, Visit visit) {
  std::set<std::array<double, 4>> seen;
  const auto visit_brick = [&](std::uint32_t entry, const std::array<double, 3>& low) {
    const int level = octree::level_of(entry);
    const double step = std::ldexp(1.0, level);
    const double edge = step * (kFieldEdge - 1);
    const auto brick = [&](std::size_t axis) { return std::floor(low[axis] / edge); };
    if (!seen.insert({double(entry), brick(0), brick(1), brick(2)}).second) return;
    const octree::Slices slices = octree::slices_of(entry);
    for (std::uint32_t n = 0; n < kFieldSlice * slices.count; ++n) {
      std::uint32_t at[3] = {n % kFieldEdge, n / kFieldEdge % kFieldEdge, slices.first + n / kFieldSlice};
      std::swap(at[slices.axis], at[2]);
      std::array<double, 3> place;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double cells = brick(axis) * edge + at[axis] * step;
        place[axis] = map.origin[axis] + voxel_size * (cells + 0.5);
      }
      visit(std::size_t{octree::slice_of(entry)} * kFieldSlice + n, place, level);
    }
  };
  const auto walk = [&](auto&& self, std::uint32_t entry, const std::array<double, 3>& low, double edge) -> void {
    if (octree::is_brick(entry)) return visit_brick(entry, low);
    if (!octree::is_node(entry)) return;
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const std::array<double, 3> corner = {low[0] + edge / 2 * (octant & 1), low[1] + edge / 2 * (octant >> 1 & 1),
                                            low[2] + edge / 2 * (octant >> 2)};
      self(self, map.field_nodes[8 * std::size_t{octree::node_of(entry)} + octant], corner, edge / 2);
    }
  };
  const std::uint32_t* root = map.field_roots;
  for (std::uint32_t z = 0; z < map.root_dims[2]; ++z) {
    for (std::uint32_t y = 0; y < map.root_dims[1]; ++y) {
      for (std::uint32_t x = 0; x < map.root_dims[0]; ++x) {
        walk(walk, octree::root_entry(*root++),
             {kRootCells * double(x), kRootCells * double(y), kRootCells * double(z)}, kRootCells);
      }
    }
  }
}

}  // namespace vps::test

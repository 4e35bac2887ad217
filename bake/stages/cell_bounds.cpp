// SPDX-License-Identifier: GPL-3.0-or-later
// Cells where nothing is proven are halved: fewer triangles count in each part.
#include "bake/stages/cell_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/stages/cell_kernels.h"

namespace vps::bake {
namespace {

constexpr float kInfinite = std::numeric_limits<float>::infinity();
constexpr float kHalfDiagonal_1 = 0.8660255F;  // of a cube whose edge is 1, rounded up
constexpr int kDeepest = 3;

// The first corner of a cell, and from it to the others, in 3x3x3 values.
constexpr std::size_t kCornerAt[8] = {0, 1, 3, 4, 9, 10, 12, 13};

// The interpolated values at 3x3x3 places of a cell: those between two others are their mean, axis by axis.
std::array<float, 27> halved(const std::array<float, 27>& values, std::size_t cell) {
  std::array<float, 27> out;
  for (std::size_t c = 0; c < 8; ++c) out[2 * kCornerAt[c]] = values[kCornerAt[cell] + kCornerAt[c]];
  const auto between = [&](std::size_t n, std::size_t step) { out[n] = (out[n - step] + out[n + step]) / 2; };
  for (const std::size_t n : {1, 7, 19, 25}) between(n, 1);
  for (const std::size_t n : {3, 4, 5, 21, 22, 23}) between(n, 3);
  for (std::size_t n = 9; n < 18; ++n) between(n, 9);
  return out;
}

}  // namespace

float CellBounds::bound(const CellCube& cube, std::span<const std::uint32_t> near) const {
  return bound(cube, near, 0);
}

float CellBounds::bound(const CellCube& cube, std::span<const std::uint32_t> near, int depth) const {
  SheetCells cells;
  cells.edge = cube.edge;
  cells.core = std::max(limits_.core_inner, limits_.core_outer);
  for (const std::uint32_t n : near) cells.error = std::max(cells.error, triangles_[n].error);
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    const auto at = [&](int axis) {
      return static_cast<float>(cube.low[axis]) + cube.edge * (static_cast<float>(n >> axis & 1) + 0.5F);
    };
    cells.x[n] = at(0);
    cells.y[n] = at(1);
    cells.z[n] = at(2);
    for (std::size_t c = 0; c < 8; ++c) {
      cells.least_stored[c][n] = cube.least_stored[kCornerAt[n] + kCornerAt[c]];
      cells.most_stored[c][n] = cube.most_stored[kCornerAt[n] + kCornerAt[c]];
    }
  }
  std::vector<std::array<float, kCubeCells>> distances(near.size());
  prove_by_plane(triangles_, near, cells, distances);
  std::vector<std::uint32_t> group;
  float worst = 0;
  for (std::size_t n = 0; n < kCubeCells && worst <= limits_.enough; ++n) {
    float bound = cells.bound[n];
    if (bound > limits_.enough) bound = std::min(bound, by_centre(cells, n));
    if (bound > limits_.enough) {
      group.clear();
      for (std::size_t i = 0; i < near.size(); ++i) {
        if (distances[i][n] > cells.reach[n]) continue;
        group.push_back(near[i]);
        if (distances[i][n] == cells.least[n]) std::swap(group.front(), group.back());
      }
      bound = std::min(bound, by_triangles(cells, n, group));
      if (bound > limits_.enough && depth < kDeepest) {
        const Vector low =
            cube.low + static_cast<double>(cube.edge) *
                           Vector(static_cast<int>(n) & 1, static_cast<int>(n) >> 1 & 1, static_cast<int>(n) >> 2);
        const CellCube parts{low, cube.edge / 2, halved(cube.most_stored, n), halved(cube.least_stored, n)};
        bound = std::min(bound, this->bound(parts, group, depth + 1));
      }
    }
    worst = std::max(worst, bound);
  }
  return worst;
}

// The side of a cell's centre, as all of the closest triangles show it.
CellBounds::Side CellBounds::side_of(const SheetCells& cells, std::size_t n) const {
  const float error = cells.error + 1e-5F;
  if (cells.lowest[n] > error) return {true, 1, limits_.core_outer};
  if (cells.highest[n] < -error) return {true, -1, limits_.core_inner};
  return {};
}

// By the distance of the cell's centre: it changes by no more than the way from there.
float CellBounds::by_centre(const SheetCells& cells, std::size_t n) const {
  const float half = kHalfDiagonal_1 * cells.edge + cells.error + 1e-5F;
  const Side side = side_of(cells, n);
  float low = kInfinite, high = -kInfinite;
  for (std::size_t c = 0; c < 8; ++c) {
    const float a = side.sign * cells.least_stored[c][n], b = side.sign * cells.most_stored[c][n];
    low = std::min({low, a, b});
    high = std::max({high, a, b});
  }
  if (side.known && cells.least[n] - half > side.core) return std::max(0.0F, side.core - low);
  const float most = cells.least[n] + half;
  return std::max(high - (side.known ? cells.least[n] - half : -most), most - low);
}

float CellBounds::by_triangles(const SheetCells& cells, std::size_t n, std::span<const std::uint32_t> group) const {
  const Side side = side_of(cells, n);
  // A triangle's plane or tangent leaves out no more than this.
  if (!side.known || cells.least[n] < cells.edge / 2) return kInfinite;
  ClearCell cell;
  cell.centre = {cells.x[n], cells.y[n], cells.z[n]};
  cell.core = side.core;
  cell.enough = limits_.enough;
  // Without surface in the cell, the plane shows one of the sides.
  cell.above = kInfinite;
  if (cells.least[n] > kHalfDiagonal_1 * cells.edge + cells.error + 1e-5F) {
    cell.above = std::max(0.0F, side.sign > 0 ? cells.above[n] : cells.below[n]);
  }
  float low = kInfinite;
  for (std::size_t c = 0; c < 8; ++c) {
    const float a = side.sign * cells.least_stored[c][n], b = side.sign * cells.most_stored[c][n];
    const float half = cells.edge / 2;
    cell.x[c] = cells.x[n] + ((c & 1) != 0 ? half : -half);
    cell.y[c] = cells.y[n] + ((c & 2) != 0 ? half : -half);
    cell.z[c] = cells.z[n] + ((c & 4) != 0 ? half : -half);
    cell.least_stored[c] = std::min(a, b);
    cell.most_stored[c] = std::max(a, b);
    low = std::min(low, cell.least_stored[c]);
  }
  const OneSidedBounds sides = prove_by_triangles(triangles_, group, cell);
  return std::max({sides.above, std::min(sides.below, side.core - low), 0.0F});
}

}  // namespace vps::bake

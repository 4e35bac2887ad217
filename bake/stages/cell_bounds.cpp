// SPDX-License-Identifier: GPL-3.0-or-later
// Cells where nothing is proven are halved: fewer triangles count in each part.
#include "bake/stages/cell_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/stages/cell_kernels.h"

namespace vps::bake {
namespace {

constexpr float kHalfDiagonal_1 = 0.8660255F;  // of a cube whose edge is 1, rounded up

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

float CellBounds::bound(const CellCube& cube, std::span<const std::uint32_t> near) {
  if (!near.empty()) return bound(cube, near, {}, 0);
  // All of it lies beyond the core.
  const auto [low, high] = std::minmax_element(cube.least_stored.begin(), cube.least_stored.end());
  return std::max(0.0F, *low > 0 ? limits_.core_outer - *low : limits_.core_inner + *high);
}

float CellBounds::bound(const CellCube& cube, std::span<const std::uint32_t> near, const Known& known, int depth) {
  SheetCells cells;
  cells.edge = cube.edge;
  cells.core = std::max(limits_.core_inner, limits_.core_outer);
  cells.farthest = known.farthest;
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
  std::array<Known, kCubeCells> found;
  found.fill(known);
  bool need_plane = known.sign == 0 || (known.sign > 0 ? known.sides.above : known.sides.below) > limits_.enough;
  if (depth == 0) need_plane = by_samples(cells, cube.exact, found);
  std::vector<OfCells>& distances = distances_[static_cast<std::size_t>(depth)];
  distances.resize(std::max(near.size(), distances.size()));
  // No plane is needed to show that interpolation is not too far from the surface.
  if (need_plane) {
    prove_by_plane(triangles_, near, cells, distances);
  } else {
    measure_cells(triangles_, near, cells, distances);
  }
  bool all_good = true;
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    found[n].farthest = cells.far[n];
    found[n].improve({cells.bound[n], cells.bound[n]});
    if (good(found[n])) continue;
    // A cell without surface lies on the side of its samples.
    const float sample = cube.exact[kCornerAt[n]];
    if (depth == 0 && sample != 0 && is_clear(cells, n)) found[n].sign = sample > 0 ? 1 : -1;
    const float sign = found[n].sign != 0 ? found[n].sign : side_of_centre(cells, n);
    found[n].improve(by_centre(cells, n, sign));
    all_good = all_good && good(found[n]);
  }
  if (!all_good) by_triangles(cells, near, distances, found);
  float worst = 0;
  for (std::size_t n = 0; n < kCubeCells && worst <= limits_.enough; ++n) {
    float bound = found[n].sides.worst();
    if (bound > limits_.enough && depth < kDeepest) {
      std::vector<std::uint32_t>& group = groups_[static_cast<std::size_t>(depth)];
      group.resize(std::max(near.size(), group.size()));
      std::size_t count = 0;
      for (std::size_t i = 0; i < near.size(); ++i) {
        group[count] = near[i];
        count += distances[i][n] <= cells.reach[n] ? 1 : 0;
      }
      const Vector low =
          cube.low + static_cast<double>(cube.edge) *
                         Vector(static_cast<int>(n) & 1, static_cast<int>(n) >> 1 & 1, static_cast<int>(n) >> 2);
      const CellCube parts{low, cube.edge / 2, halved(cube.most_stored, n), halved(cube.least_stored, n)};
      bound = std::min(bound, this->bound(parts, std::span(group).first(count), found[n], depth + 1));
    }
    worst = std::max(worst, bound);
  }
  return worst;
}

// Where samples lie on one side and are far enough away, so do the cells between them.
// @return whether there are others
bool CellBounds::by_samples(const SheetCells& cells, const std::array<float, 27>& exact, std::span<Known> found) const {
  std::array<OfCells, kCubeCells> corners;
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    for (std::size_t c = 0; c < 8; ++c) corners[c][n] = exact[kCornerAt[n] + kCornerAt[c]];
  }
  const OfCells above = prove_by_samples(cells, corners);
  bool others = false;
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    others = others || above[n] > limits_.enough;
    if (above[n] == kInfinite) continue;
    found[n].sign = corners[0][n] > 0 ? 1 : -1;
    (found[n].sign > 0 ? found[n].sides.above : found[n].sides.below) = above[n];
  }
  return others;
}

// Whether no surface lies in a cell.
bool CellBounds::is_clear(const SheetCells& cells, std::size_t n) {
  return cells.least[n] > kHalfDiagonal_1 * cells.edge + cells.error + 1e-5F;
}

// The side of a cell's centre, as all of the closest triangles show it; 0 where they do not.
float CellBounds::side_of_centre(const SheetCells& cells, std::size_t n) {
  const float error = cells.error + 1e-5F;
  if (cells.lowest[n] > error) return 1;
  return cells.highest[n] < -error ? -1 : 0;
}

// By the distance of the cell's centre: it changes by no more than the way from there. Only distances up to the core
// count.
CellBounds::Sides CellBounds::by_centre(const SheetCells& cells, std::size_t n, float sign) const {
  const float half = kHalfDiagonal_1 * cells.edge + cells.error + 1e-5F;
  float low = kInfinite, high = -kInfinite;
  for (std::size_t c = 0; c < 8; ++c) {
    const float a = cells.least_stored[c][n], b = cells.most_stored[c][n];
    low = std::min({low, a, b});
    high = std::max({high, a, b});
  }
  const float nearest = (sign > 0 ? cells.least[n] : -cells.least[n]) - half;
  const float farthest = (sign < 0 ? -cells.least[n] : cells.least[n]) + half;
  const float above = nearest > limits_.core_outer ? 0 : high - std::max(nearest, -limits_.core_inner);
  const float below = farthest < -limits_.core_inner ? 0 : std::min(farthest, limits_.core_outer) - low;
  return {std::max(above, 0.0F), std::max(below, 0.0F)};
}

// For cells whose sides are known.
void CellBounds::by_triangles(const SheetCells& cells, std::span<const std::uint32_t> near,
                              std::span<const OfCells> distances, std::span<Known> found) const {
  SidedCells open;
  open.x = cells.x;
  open.y = cells.y;
  open.z = cells.z;
  open.edge = cells.edge;
  open.enough = limits_.enough;
  open.reach.fill(-1);
  open.core.fill(0);
  for (OfCells& corner : open.most_stored) corner.fill(0);
  bool any_open = false;
  std::array<float, kCubeCells> signs{};
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    const float sign = found[n].sign != 0 ? found[n].sign : side_of_centre(cells, n);
    // Nearer to the surface, planes and tangents hardly ever leave out all triangles.
    const bool tried = !good(found[n]) && cells.least[n] >= 0.6F * cells.edge;
    signs[n] = tried ? sign : 0;
    if (signs[n] == 0) continue;
    float& towards = sign > 0 ? found[n].sides.above : found[n].sides.below;
    if (is_clear(cells, n)) {
      // The plane shows one of the sides.
      towards = std::min(towards, std::max(0.0F, sign > 0 ? cells.above[n] : cells.below[n]));
    }
    if (towards <= limits_.enough) continue;
    for (std::size_t c = 0; c < 8; ++c) {
      open.most_stored[c][n] = std::max(sign * cells.least_stored[c][n], sign * cells.most_stored[c][n]);
    }
    open.reach[n] = cells.reach[n];
    open.core[n] = sign > 0 ? limits_.core_outer : limits_.core_inner;
    any_open = true;
  }
  if (any_open) {
    const OfCells above = prove_above(triangles_, near, distances, open);
    for (std::size_t n = 0; n < kCubeCells; ++n) {
      float& towards = signs[n] > 0 ? found[n].sides.above : found[n].sides.below;
      towards = std::min(towards, above[n]);
    }
  }
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    if (signs[n] == 0) continue;
    float& away = signs[n] > 0 ? found[n].sides.below : found[n].sides.above;
    if (away > limits_.enough) away = std::min(away, below_triangles(cells, n, signs[n], near, distances));
  }
}

// How far interpolation can be below the distance: by the closest triangle, and by others where that does not do.
float CellBounds::below_triangles(const SheetCells& cells, std::size_t n, float sign,
                                  std::span<const std::uint32_t> near, std::span<const OfCells> distances) const {
  SidedCell cell{{cells.x[n], cells.y[n], cells.z[n]}, cells.edge, {}};
  float sum = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    cell.least_stored[c] = std::min(sign * cells.least_stored[c][n], sign * cells.most_stored[c][n]);
    sum += cell.least_stored[c];
  }
  const auto first = static_cast<std::size_t>(cells.closest[n]);
  float best = prove_below(triangles_[near[first]], cell);
  // The mean over the corners is at least that of the centre, because a triangle's distance is convex.
  const float useful = sum / 8 + limits_.enough;
  for (std::size_t i = 0; i < near.size() && best > limits_.enough; ++i) {
    if (i != first && distances[i][n] <= useful) best = std::min(best, prove_below(triangles_[near[i]], cell));
  }
  return best;
}

}  // namespace vps::bake

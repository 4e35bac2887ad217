// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The two proofs for cells: by a plane and by triangles. Vectorized; docs/internals/bounds.md, "Between
/// samples". Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>

#include "bake/stages/float_distances.h"

namespace vps::bake {

inline constexpr std::size_t kCubeCells = 8;
/// A list of triangles must reach this much farther than those that can be closest, because lines along a plane's
/// normal may meet them. [vx]
inline constexpr float kSheetThickness = 0.4F;

using OfCells = std::array<float, kCubeCells>;

/// The eight cells of a cube, and what a plane proves of them. Lengths are in voxels.
struct SheetCells {
  alignas(32) OfCells x, y, z;  ///< centres
  /// [corner][cell] signed distances as stored: at least these, and at most these in size.
  alignas(32) std::array<OfCells, kCubeCells> least_stored{}, most_stored{};
  float edge = 0;
  float core = 0;                                           ///< the larger one
  float farthest = std::numeric_limits<float>::infinity();  ///< no point of the cube is farther from the surface

  // Results.
  float error = 0;              ///< largest error of the triangles
  alignas(32) OfCells least;    ///< distance of the centre from the triangles
  alignas(32) OfCells closest;  ///< place in the list of the triangle at this distance
  alignas(32) OfCells far;      ///< no point of the cell is farther from the surface
  alignas(32) OfCells reach;    ///< triangles up to this distance count
  alignas(32) OfCells bound;    ///< infinite where a plane proves nothing
  /// How far interpolation can be above the distance outside, and below it inside; infinite where not proven.
  alignas(32) OfCells above, below;
  alignas(32) OfCells lowest, highest;  ///< heights of the centre over the nearest triangles
};

/// How far interpolation can be above the distance in cells without surface, from the samples at their corners alone.
/// @param exact  [corner][cell] signed distances, or nearer to 0
[[nodiscard]] OfCells prove_by_samples(const SheetCells& cells, const std::array<OfCells, kCubeCells>& exact);

/// @param distances  receives those of the centres from each triangle
void prove_by_plane(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                    std::span<OfCells> distances);
/// The distances and heights alone: a plane proves nothing.
void measure_cells(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                   std::span<OfCells> distances);

/// Cells whose centres lie on a known side. Distances are positive there.
struct SidedCells {
  alignas(32) OfCells x, y, z;                              ///< centres
  alignas(32) std::array<OfCells, kCubeCells> most_stored;  ///< [corner][cell] distances as stored: at most these
  alignas(32) OfCells reach;  ///< triangles up to this distance count; negative: the cell is left out
  alignas(32) OfCells core;   ///< how far interpolation has to be good
  float edge = 0;
  float enough = 0;  ///< a larger bound counts as infinite
};

/// How far interpolation can be above the distance, from all triangles. Infinite where one may meet the cell, and for
/// cells that are left out.
/// @param near       all triangles that can be closest to a point of a cell or meet it
/// @param distances  of the centres from each
[[nodiscard]] OfCells prove_above(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near,
                                  std::span<const OfCells> distances, const SidedCells& cells);

/// One of these cells.
struct SidedCell {
  std::array<float, 3> centre{};
  float edge = 0;
  alignas(32) OfCells least_stored{};  ///< distances as stored at the corners, x fastest: at least these
};

/// How far interpolation can be below the distance, from a triangle.
[[nodiscard]] float prove_below(const ProofTriangle& triangle, const SidedCell& cell);

}  // namespace vps::bake

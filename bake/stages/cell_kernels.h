// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The two proofs for single cells: by a plane and by triangles. Vectorized; docs/internals/bounds.md, "Between
/// samples". Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/stages/float_distances.h"

namespace vps::bake {

inline constexpr std::size_t kCubeCells = 8;
/// A list of triangles must reach this much farther than those that can be closest, because lines along a plane's
/// normal may meet them. [vx]
inline constexpr float kSheetThickness = 0.4F;

/// The eight cells of a cube, and what a plane proves of them. Lengths are in voxels.
struct SheetCells {
  alignas(32) std::array<float, kCubeCells> x, y, z;  ///< centres
  /// [corner][cell] signed distances as stored: at least these, and at most these in size.
  alignas(32) std::array<std::array<float, kCubeCells>, kCubeCells> least_stored{}, most_stored{};
  float edge = 0;
  float core = 0;   ///< the larger one
  float error = 0;  ///< largest error of the triangles

  // Results.
  alignas(32) std::array<float, kCubeCells> least;  ///< distance of the centre from the triangles
  alignas(32) std::array<float, kCubeCells> reach;  ///< triangles up to this distance count
  alignas(32) std::array<float, kCubeCells> bound;  ///< infinite where a plane proves nothing
  /// How far interpolation can be above the distance outside, and below it inside; infinite where not proven.
  alignas(32) std::array<float, kCubeCells> above, below;
  alignas(32) std::array<float, kCubeCells> lowest, highest;  ///< heights of the centre over the nearest triangles
};

/// @param distances  receives those of the centres from each triangle
void prove_by_plane(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                    std::span<std::array<float, kCubeCells>> distances);

/// A cell without surface in it.
struct ClearCell {
  std::array<float, 3> centre{};
  alignas(32) std::array<float, kCubeCells> x{}, y{}, z{};  ///< corners, x fastest
  /// Distances as stored there, positive: at least and at most these.
  alignas(32) std::array<float, kCubeCells> least_stored{}, most_stored{};
  float core = 0;
  float above = 0;   ///< a bound that is known already, or infinite
  float enough = 0;  ///< a larger bound counts as infinite, a smaller one is not searched for
};

/// How far interpolation can be above and below the distance. Above is infinite where a triangle may meet the cell.
struct OneSidedBounds {
  float above = 0, below = 0;
};

/// @param near  all triangles that can be closest to a point of the cell or meet it
[[nodiscard]] OneSidedBounds prove_by_triangles(std::span<const ProofTriangle> triangles,
                                                std::span<const std::uint32_t> near, const ClearCell& cell);

}  // namespace vps::bake

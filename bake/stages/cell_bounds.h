// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Proves how far interpolation can be from the exact distance anywhere in a cell. docs/internals/bounds.md,
/// "Between samples". Vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/stages/cell_kernels.h"

namespace vps::bake {

/// Eight cells of a cube, x fastest, and the values that they interpolate between.
struct CellCube {
  Vector low = Vector::Zero();  ///< relative to the triangles' centre. [vx]
  float edge = 0;               ///< of a cell. [vx]
  /// Signed distances as stored, x fastest: at most these in size, and at least these. [vx]
  std::array<float, 27> most_stored, least_stored;
};

/// What a bound has to cover. Lengths are in voxels.
struct CellLimits {
  float core_inner = 0, core_outer = 0;  ///< how far inside and outside interpolation has to be good
  float enough = 0;                      ///< a smaller bound is not searched for
};

class CellBounds {
 public:
  /// @param triangles  must outlive this object
  CellBounds(std::span<const ProofTriangle> triangles, const CellLimits& limits)
      : triangles_(triangles), limits_(limits) {}

  /// Bound of |interpolated - exact distance| in all cells; beyond the core, of how far interpolation falls below the
  /// core. May be above the true maximum, and ends early when it is above `enough`. Every instruction set gives the
  /// same bits. [vx]
  /// @param near  positions in `triangles` of all whose distance from the cube's centre is at most the least one, the
  ///              cube's diagonal and kSheetThickness
  [[nodiscard]] float bound(const CellCube& cube, std::span<const std::uint32_t> near) const;

 private:
  struct Side {
    bool known = false;
    float sign = 1;  // of distances there
    float core = 0;
  };
  [[nodiscard]] float bound(const CellCube& cube, std::span<const std::uint32_t> near, int depth) const;
  [[nodiscard]] Side side_of(const SheetCells& cells, std::size_t n) const;
  [[nodiscard]] float by_centre(const SheetCells& cells, std::size_t n) const;
  [[nodiscard]] float by_triangles(const SheetCells& cells, std::size_t n, std::span<const std::uint32_t> group) const;

  std::span<const ProofTriangle> triangles_;
  CellLimits limits_;
};

}  // namespace vps::bake

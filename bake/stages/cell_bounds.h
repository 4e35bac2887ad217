// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Proves how far interpolation can be from the exact distance anywhere in a cell. docs/internals/bounds.md,
/// "Between samples". Vectorized. Internal to bake.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
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
  std::array<float, 27> exact{};  ///< signed distances, or nearer to 0 on the same side; 0: not known. [vx]
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
  /// core. May be above the true maximum. What is above `enough` is no bound: the search ends there. Every instruction
  /// set gives the same bits. [vx]
  /// @param near  positions in `triangles` of all whose distance from the cube's centre is at most the least one, the
  ///              cube's diagonal and kSheetThickness
  [[nodiscard]] float bound(const CellCube& cube, std::span<const std::uint32_t> near);

 private:
  static constexpr int kDeepest = 3;  // cells are halved this often
  static constexpr float kInfinite = std::numeric_limits<float>::infinity();

  // How far interpolation can be above the signed distance, and below it, in a cell.
  struct Sides {
    float above, below;
    [[nodiscard]] float worst() const { return std::max(above, below); }
  };
  // What is known of a cell. The side is 0 where the surface may pass through it.
  struct Known {
    Sides sides{kInfinite, kInfinite};
    float sign = 0;
    float farthest = kInfinite;  // no point of it is farther from the surface
    void improve(const Sides& other) {
      sides = {std::min(sides.above, other.above), std::min(sides.below, other.below)};
    }
  };

  float bound(const CellCube& cube, std::span<const std::uint32_t> near, const Known& known, int depth);
  bool by_samples(const SheetCells& cells, const std::array<float, 27>& exact, std::span<Known> found) const;
  [[nodiscard]] static bool is_clear(const SheetCells& cells, std::size_t n);
  [[nodiscard]] static float side_of_centre(const SheetCells& cells, std::size_t n);
  [[nodiscard]] Sides by_centre(const SheetCells& cells, std::size_t n, float sign) const;
  void by_triangles(const SheetCells& cells, std::span<const std::uint32_t> near, std::span<const OfCells> distances,
                    std::span<Known> found) const;
  [[nodiscard]] float below_triangles(const SheetCells& cells, std::size_t n, float sign,
                                      std::span<const std::uint32_t> near, std::span<const OfCells> distances) const;
  [[nodiscard]] bool good(const Known& known) const { return known.sides.worst() <= limits_.enough; }

  std::span<const ProofTriangle> triangles_;
  CellLimits limits_;
  // Of each depth.
  std::array<std::vector<OfCells>, kDeepest + 1> distances_;
  std::array<std::vector<std::uint32_t>, kDeepest + 1> groups_;
};

}  // namespace vps::bake

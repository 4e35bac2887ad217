// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The exact samples of one block of 8x8x8 cells, and the estimated error of interpolation between them. Internal
/// to bake.
#pragma once

#include <array>

#include "bake/stages/chord_errors.h"
#include "bake/stages/distance_field.h"

namespace vps::bake {

using Index = std::array<std::int32_t, 3>;

/// Estimated error of interpolation in each cell: the largest chord error along each axis, summed over the axes. Cell
/// (x,y,z) has number (8 z + y) 8 + x.
using CellErrors = std::array<float, kBrickVoxels>;
void cell_errors(const ChordLines& lines, CellErrors& errors);

/// Values at the voxel centres of a brick and at the first ones of its upper neighbours. Sample (x,y,z) has number
/// (9 z + y) 9 + x.
class OctantSamples {
 public:
  static constexpr int kSide = static_cast<int>(kBrickEdge) + 1;
  static constexpr std::size_t number(int x, int y, int z) {
    return static_cast<std::size_t>((z * kSide + y) * kSide + x);
  }

  /// Number of a cell in the cell errors.
  static constexpr std::size_t cell(int x, int y, int z) {
    return static_cast<std::size_t>((z * static_cast<int>(kBrickEdge) + y) * static_cast<int>(kBrickEdge) + x);
  }

  OctantSamples(const Grid& grid, const InsideRuns& runs, const BandField& field);

  /// @param brick  whose voxel (0,0,0) is sample (0,0,0)
  void load(const Index3& brick);
  /// Computes chord errors, cell errors and shifts. Only worth its time where samples lie in the band.
  void estimate();

  /// Exact, or the end of the field's band. [m]
  [[nodiscard]] double value(std::size_t n) const { return value_[n]; }
  [[nodiscard]] std::uint32_t closest(std::size_t n) const { return closest_[n]; }  ///< triangle, or kNoTriangle
  [[nodiscard]] const CellErrors& errors() const { return errors_; }                ///< [vx]

  /// Correction of a sample that halves the error of interpolation, as far as the samples show it. Chords between
  /// neighbours err to one side, and the correction moves their ends to the other side by half of that. Every octant
  /// that has the sample gives the same correction.
  [[nodiscard]] double shift(std::size_t n) const { return shift_[n]; }  ///< for cells of one voxel, half of that. [vx]
  /// For cells of two voxels, at every second sample along each axis. [vx]
  [[nodiscard]] std::array<float, 125> shifts_of_two() const;

 private:
  void load_lines();
  void add_shifts();

  const Grid& grid_;
  const InsideRuns& runs_;
  const BandField& field_;
  std::array<std::uint32_t, 27> bricks_;  // numbers of the brick and its neighbours, or kNoBrick
  std::array<double, std::size_t{kSide} * kSide * kSide> value_;
  std::array<std::uint32_t, std::size_t{kSide} * kSide * kSide> closest_;
  ChordLines lines_;
  CellErrors errors_;
  std::array<float, std::size_t{kSide} * kSide * kSide> shift_;
};

}  // namespace vps::bake

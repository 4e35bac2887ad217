// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Exact samples of single field bricks, at the centres of voxels and between them. Internal to bake.
#pragma once

#include <cmath>
#include <span>

#include "bake/stages/cell_bounds.h"
#include "bake/stages/nearest_triangle.h"
#include "bake/stages/octant_samples.h"
#include "bake/stages/octant_trial.h"
#include "bake/stages/sample_field.h"

namespace vps::bake {

/// Places are counted in quarter voxels from the centre of voxel (0,0,0), so that they are integers at every level.
inline constexpr std::int32_t kQuarters = 4;

struct FieldBrick {
  static constexpr int kEdge = kFieldEdge;
  static constexpr int kSamples = kEdge * kEdge * kEdge;
  static constexpr int kCells = kEdge - 1;  ///< along an edge

  static constexpr int sample_at(int x, int y, int z) { return (z * kEdge + y) * kEdge + x; }
  /// From one sample to the next. [quarters]
  static constexpr std::int32_t step_of(int level) { return level >= 0 ? kQuarters << level : kQuarters >> -level; }
  /// First sample of the brick of half the size that lies in one of the eight octants. [quarters]
  [[nodiscard]] Index octant_base(int octant) const;
  /// One of the 27 samples of an octant, x fastest.
  static constexpr int in_octant(int octant, int n) {
    return sample_at(2 * (octant & 1) + n % 3, 2 * (octant >> 1 & 1) + n / 3 % 3, 2 * (octant >> 2) + n / 9);
  }

  FieldBrick() {}  // NOLINT(modernize-use-equals-default): values stay unset

  int level = 0;
  Index base{};                                 ///< [quarters]
  std::array<double, kSamples> value;           ///< exact, or the end of the known band. [m]
  std::array<double, kSamples> fitted;          ///< the value that is stored. [m]
  std::array<std::uint32_t, kSamples> closest;  ///< triangles, or kNoTriangle
  std::uint32_t entry = kFarOutside;            ///< the entry that refers to it, once it is stored
};

/// Estimated errors of interpolation in the cells between a brick's exact samples. [vx]
struct BrickErrors {
  static constexpr int number(int x, int y, int z) { return (z * FieldBrick::kCells + y) * FieldBrick::kCells + x; }
  [[nodiscard]] double at(int x, int y, int z) const { return cells[static_cast<std::size_t>(number(x, y, z))]; }
  std::array<float, FieldBrick::kCells * FieldBrick::kCells * FieldBrick::kCells> cells;
};

/// Triangles near a cube: positions in the list of the voxel brick. Those that can be closest to a point of it come
/// first; proofs need all.
struct NearList {
  std::span<const std::uint32_t> all;
  std::size_t count = 0;
  [[nodiscard]] std::span<const std::uint32_t> closest() const { return all.first(count); }
};

/// Triangles near a cube, octant by octant.
struct NearTriangles {
  std::array<std::uint32_t, 9> start{};
  std::array<std::uint32_t, 8> closest{};
  std::vector<std::uint32_t> positions;
  [[nodiscard]] NearList in_octant(int octant) const {
    const auto n = static_cast<std::size_t>(octant);
    return {std::span(positions).subspan(start[n], start[n + 1] - start[n]), closest[n]};
  }
};

/// The inputs of sampling. All must outlive the samplers.
struct FieldSource {
  const Surface& surface;
  const Grid& grid;
  const InsideRuns& runs;
  const BandField& field;
  const InsideTest& inside;
  const FieldTolerance& tolerance;
};

/// Makes the field bricks of one octant after the other. An octant is the cells between the voxel centres of a voxel
/// brick and the first ones of its upper neighbours.
class BrickSampler {
 public:
  explicit BrickSampler(const FieldSource& from);

  /// Loads an octant. @param at  its voxel brick. @return false when no sample of it lies in the band
  [[nodiscard]] bool load(const std::uint32_t (&at)[3]);
  /// Whether the first voxel of a voxel brick lies inside.
  [[nodiscard]] bool is_inside(const std::uint32_t (&at)[3]) const;

  /// Sets the coarsest brick, over the whole octant.
  void load_octant(FieldBrick& brick) const { load_voxels(kCoarsestLevel, octant_base_, brick); }
  /// Sets a brick of the octant with samples at the centres of voxels. @param level  [Limits: value >= 0]
  void load_voxels(int level, const Index& base, FieldBrick& brick) const;
  /// Sets the brick of half the size over an octant of `parent`, with samples between voxel centres.
  /// @param from  triangles that can be closest to its points
  void load_between(const FieldBrick& parent, int octant, std::span<const std::uint32_t> from, FieldBrick& brick) const;
  /// Whether the parent's interpolation is good enough at all samples of `load_between` that the parent does not have.
  /// Computed in float: false where rounding leaves a doubt.
  /// @param from   as above
  /// @param noted  an error within the band that is larger than this needs an exact value: false. [m]
  [[nodiscard]] bool surely_interpolates(const FieldBrick& parent, int octant, std::span<const std::uint32_t> from,
                                         double noted) const;
  /// Triangles near a brick with samples at the centres of voxels.
  [[nodiscard]] NearList near(const FieldBrick& brick);
  /// Those near an octant of the octant that is loaded.
  [[nodiscard]] NearList near_octant(int octant) {
    if (listed_.empty()) list_triangles();
    return near_bricks_.in_octant(octant);
  }
  /// Those near a brick's octants. @param from  those near the brick
  [[nodiscard]] NearTriangles near_octants(const FieldBrick& brick, std::span<const std::uint32_t> from) const {
    return near_octants(brick.base, FieldBrick::step_of(brick.level) * FieldBrick::kCells, from);
  }
  [[nodiscard]] BrickErrors errors(const FieldBrick& brick) const;
  /// Proven bound of interpolation's error in an octant of a brick; infinite where none up to `enough` is found. [m]
  /// @pre the tolerance asks for proofs
  /// @param from  all triangles near it
  [[nodiscard]] double bound(const FieldBrick& brick, int octant, std::span<const std::uint32_t> from,
                             double enough) const;

  [[nodiscard]] Vector place(const FieldBrick& brick, std::size_t sample) const;
  [[nodiscard]] double quarter() const { return grid_.voxel_size / kQuarters; }  ///< of a voxel. [m]

 private:
  NearTriangles near_octants(const Index& base, std::int32_t edge, std::span<const std::uint32_t> from) const;
  Vector place(const Index& at) const { return grid_.centre(0, 0, 0) + quarter() * Vector(at[0], at[1], at[2]); }
  PointLattice lattice(const Index& base, int level) const {
    return {place(base), quarter() * FieldBrick::step_of(level)};
  }
  // The same points from the octant's centre. [vx]
  Places128 float_places(const Index& base, int level) const;
  std::array<int, 3> place_in_octant(const FieldBrick& brick) const;
  // From the octant's centre. [vx]
  Vector from_centre(const Index& at) const {
    return Vector(at[0] - octant_base_[0], at[1] - octant_base_[1], at[2] - octant_base_[2]) / kQuarters -
           Vector::Constant(kBrickEdge / 2.0);
  }
  void list_triangles();
  bool any_in_band() const;
  double fitted(double value, double shift_vx) const;

  const Surface& surface_;
  const Grid& grid_;
  const InsideRuns& runs_;
  const BandField& field_;
  const InsideTest& inside_;
  const FieldTolerance& tolerance_;
  OctantSamples octant_;
  std::array<double, OctantSamples::number(0, 0, OctantSamples::kSide)> fitted_;  // for cells of one voxel. [m]
  Index octant_base_{};                                                           // of its sample (0,0,0)
  std::span<const std::uint32_t> listed_;    // triangles near the octant, once they are needed
  std::vector<FloatTriangle> float_listed_;  // the same, from the octant's centre, in voxels
  std::vector<ProofTriangle> proof_listed_;  // the same; empty without proofs
  NearTriangles near_bricks_;                // the same, by bricks of level 0
  const double reach_;                       // distances between voxel centres are known up to here. [m]
};

}  // namespace vps::bake

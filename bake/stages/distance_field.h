// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Exact signed distances in a narrow band. Paper: Sec. 2.1.1; its gradient walk is replaced by the exact closest
/// point.
#pragma once

#include <bit>

#include "bake/stages/fill_layers.h"
#include "bake/unset_vector.h"

namespace vps::bake {

inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFu;

/// Where the exact voxels of a brick begin, and those of its planes z after that.
struct PlaneStarts {
  std::size_t first = 0;
  std::array<std::uint16_t, kBrickEdge> plane{};
};

/// Penetrations V of the voxel centres of all bricks that hold a centre within the band. Only those within it take
/// memory, about two fifths of all: V of the others is the end of the band.
struct BandField {
  BrickSet set;
  double band_inner = 0, band_outer = 0;  ///< [m]
  std::vector<BrickMask> inside;
  std::vector<BrickMask> exact;               ///< voxels with -band_outer <= V <= band_inner
  std::vector<PlaneStarts> start;             ///< where the exact voxels of a brick's planes begin in the next two
  UnsetVector<double> penetration;            ///< of the exact voxels, brick by brick. [m]
  UnsetVector<std::uint32_t> closest;         ///< the same voxels: triangle of the closest point
  std::vector<std::size_t> near_start;        ///< [n+1]: a brick's first entry in `near_triangles`
  std::vector<std::uint32_t> near_triangles;  ///< triangles that may be within the band of a brick's voxel centres

  /// Whether V is exact at a voxel of a brick of the set.
  [[nodiscard]] bool is_exact(std::size_t brick, std::uint32_t voxel) const { return test_bit(exact[brick], voxel); }
  /// Place of a voxel in `penetration` and `closest`. The exact voxels of a row along x follow each other.
  /// @pre is_exact, or the next exact voxel is meant
  [[nodiscard]] std::size_t at(std::size_t brick, std::uint32_t voxel) const {
    const std::uint64_t before = exact[brick][voxel / 64] & ((std::uint64_t{1} << voxel % 64) - 1);
    return start[brick].first + start[brick].plane[voxel / 64] + count_bits(before);
  }
  /// V at a voxel of a brick of the set; the end of the band where it is not exact.
  [[nodiscard]] double value(std::size_t brick, std::uint32_t voxel) const {
    if (is_exact(brick, voxel)) return penetration[at(brick, voxel)];
    return test_bit(inside[brick], voxel) ? band_inner : -band_outer;
  }
  /// Triangle of the closest point of a voxel; kNoTriangle beyond the band.
  [[nodiscard]] std::uint32_t triangle(std::size_t brick, std::uint32_t voxel) const {
    return is_exact(brick, voxel) ? closest[at(brick, voxel)] : kNoTriangle;
  }
  /// Calls visit(voxel, place) for the exact voxels of a brick, in order.
  template <class Visit>
  void for_each_exact(std::size_t brick, Visit visit) const {
    std::size_t place = start[brick].first;
    for (std::uint32_t z = 0; z < kBrickEdge; ++z) {
      for (std::uint64_t left = exact[brick][z]; left != 0; left &= left - 1)
        visit(64 * z + static_cast<std::uint32_t>(std::countr_zero(left)), place++);
    }
  }
  /// V at a voxel; the end of the band where its brick is not in the set.
  [[nodiscard]] double value(const Grid& grid, const InsideRuns& runs, std::uint32_t i, std::uint32_t j,
                             std::uint32_t k) const;
};

/// @param band_inner, band_outer  depth inside and distance outside up to which values are exact. [Units: m]
[[nodiscard]] BandField distance_field(const Surface& surface, const Grid& grid, const InsideRuns& runs,
                                       double band_inner, double band_outer);

/// Gradient of V at a point, exact: unit, along the line to the closest point.
/// @param triangle    of the closest point; kNoTriangle gives zero
/// @param voxel_size  points nearer to the surface than a billionth of this count as on it
[[nodiscard]] Vector exact_gradient(const Surface& surface, const Vector& point, std::uint32_t triangle, bool inside,
                                    double voxel_size);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Exact signed distances in a narrow band. Paper: Sec. 2.1.1; its gradient walk is replaced by the exact closest
/// point.
#pragma once

#include "bake/stages/fill_layers.h"

namespace vps::bake {

inline constexpr std::uint32_t kNoTriangle = 0xFFFFFFFFu;

/// Penetrations V of the voxel centres of all bricks that hold a centre within the band.
struct BandField {
  BrickSet set;
  double band_inner = 0, band_outer = 0;  ///< [m]
  std::vector<BrickMask> inside;
  std::vector<double>
      penetration;  ///< [n,8,8,8]: exact where -band_outer <= V <= band_inner, else the end of the band. [m]
  std::vector<std::uint32_t> closest;         ///< [n,8,8,8]: triangle of the closest point, kNoTriangle beyond the band
  std::vector<std::size_t> near_start;        ///< [n+1]: a brick's first entry in `near_triangles`
  std::vector<std::uint32_t> near_triangles;  ///< triangles that may be within the band of a brick's voxel centres

  [[nodiscard]] std::size_t at(std::size_t brick, std::uint32_t voxel) const { return brick * kBrickVoxels + voxel; }
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

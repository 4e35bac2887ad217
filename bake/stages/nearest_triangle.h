// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The nearest triangles of the points of a lattice, vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/grid.h"
#include "bake/stages/float_distances.h"

namespace vps::bake {

/// Points in a cube, x fastest.
struct PointLattice {
  Vector first = Vector::Zero();  ///< point (0,0,0). [m]
  double step = 0;                ///< [m]

  [[nodiscard]] Vector at(int x, int y, int z) const { return first + step * Vector(x, y, z); }
};

/// The nearest triangle of each point of a lattice so far.
template <std::size_t kCount>
struct NearestOf {
  alignas(64) std::array<double, kCount> squared;  ///< distance. [m^2]
  /// Number of the triangle, as a double so that all lanes have one width. Negative: none yet.
  alignas(64) std::array<double, kCount> triangle;
};

/// Of 8x8x8 points.
using NearestTriangles = NearestOf<kBrickVoxels>;

/// Of 5x5x5 points, and three that do not count.
using NearestToSamples = NearestOf<128>;

/// Offers triangles to 8x8x8 points that may lie within `band` of them. Each point keeps the nearest triangle, and the
/// earliest in the list among equals. Results do not depend on the machine's vector instructions, because every
/// operation is rounded by itself.
/// @pre distances of points and triangles are below a million steps
void offer_triangles(const Surface& surface, std::span<const std::uint32_t> triangles, const PointLattice& points,
                     double band, NearestTriangles& nearest);

/// The same for 5x5x5 points, where it is known which triangles can be nearest to them.
/// @param bits  of `find_where_nearest` with a slack of kEquallyNear steps
void offer_triangles(const Surface& surface, std::span<const std::uint32_t> triangles, std::span<const PlaceBits> bits,
                     const PointLattice& points, double band, NearestToSamples& nearest);

/// Distances that differ by less, in steps, may be in another order where they are rounded.
inline constexpr double kEquallyNear = 1e-4;

}  // namespace vps::bake

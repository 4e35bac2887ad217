// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The nearest triangles of the points of a lattice, vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/grid.h"

namespace vps::bake {

/// A cube of up to 8x8x8 points. Point (x,y,z) has number (8 z + y) 8 + x.
struct PointLattice {
  Vector first = Vector::Zero();  ///< point (0,0,0). [m]
  double step = 0;                ///< [m]
  int edge = kBrickEdge;          ///< points along an axis. [Limits: 1 <= value <= 8]

  [[nodiscard]] Vector at(int x, int y, int z) const { return first + step * Vector(x, y, z); }
};

/// The nearest triangle of each point of a lattice so far.
struct NearestTriangles {
  alignas(64) std::array<double, kBrickVoxels> squared;  ///< distance. [m^2]
  /// Number of the triangle, as a double so that all lanes have one width. Negative: none yet.
  alignas(64) std::array<double, kBrickVoxels> triangle;
};

/// Offers triangles to the points of a lattice that may lie within `band` of them. Each point keeps the nearest
/// triangle, and the earliest in the list among equals. Results do not depend on the machine's vector instructions,
/// because every operation is rounded by itself.
/// @pre distances of points and triangles are below a million steps
void offer_triangles(const Surface& surface, std::span<const std::uint32_t> triangles, const PointLattice& points,
                     double band, NearestTriangles& nearest);

}  // namespace vps::bake

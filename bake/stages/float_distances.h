// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Distances to triangles in float, with proven error bounds. They find the few places where exact distances are
/// needed. Vectorized. Internal to bake.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "bake/geometry.h"

namespace vps::bake {

/// A triangle near a centre. Lengths are in units, places relative to the centre.
struct FloatTriangle {
  /// A x + b y + c z + d at a place (x,y,z).
  struct Linear {
    float a, b, c, d;
  };
  Linear height;      ///< above the triangle's plane
  Linear along[3];    ///< from an edge's start, in the edge's direction
  Linear outward[3];  ///< from an edge, in the triangle's plane
  float length[3];    ///< of the edges
  float error;        ///< bound of the distances' error
};

/// With what a proof needs besides distances.
struct ProofTriangle : FloatTriangle {
  Linear plane;        ///< as `height`, but for slivers, too; zero where the normal is not known
  float corner[3][3];  ///< places
};

/// @param unit   [m]
/// @param reach  the error is bounded for places at most this far from the centre, along each axis. [Units: units]
[[nodiscard]] FloatTriangle float_triangle(const Mesh& mesh, std::size_t triangle, const Vector& centre, double unit,
                                           double reach);
/// @param distances  float_triangle of the same triangle, centre and unit
[[nodiscard]] ProofTriangle proof_triangle(const FloatTriangle& distances, const Mesh& mesh, std::size_t triangle,
                                           const Vector& centre, double unit);

/// Places relative to a centre. [Units: units]
template <std::size_t kCount>
struct FloatPlaces {
  static_assert(kCount % 16 == 0, "whole vectors");
  alignas(64) std::array<float, kCount> x{}, y{}, z{};
};

using Places16 = FloatPlaces<16>;
using Places128 = FloatPlaces<128>;

/// Distances of all places from each of some triangles. [Units: units]
/// @param chosen     positions in `triangles`
/// @param distances  as many
void triangle_distances(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                        const Places16& places, std::span<std::array<float, 16>> distances);

/// Distance of each place from the nearest of some triangles; infinite without any. [Units: units]
/// @param chosen  positions in `triangles`
void nearest_distances(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                       const Places128& places, std::array<float, 128>& distances);

/// One bit per place: place n is bit n % 8 of byte n / 8.
using PlaceBits = std::array<std::uint8_t, 16>;

/// Finds the places that each of some triangles can be nearest to. Bits of others may be set, too.
/// @param chosen  positions in `triangles`
/// @param slack   what counts as equally near. [Units: units]
/// @param bits    as many as are chosen
void find_where_nearest(std::span<const FloatTriangle> triangles, std::span<const std::uint32_t> chosen,
                        const Places128& places, float slack, std::span<PlaceBits> bits);

}  // namespace vps::bake

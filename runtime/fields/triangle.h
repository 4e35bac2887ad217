// SPDX-License-Identifier: Zlib
/// @file Triangles, prepared for the distances of many points. Internal.
#pragma once

#include <span>

#include "runtime/fields/penetration.h"

namespace vps::detail {

/// The place of a triangle that is nearest to a point.
struct NearestPlace {
  Vec3 at;
  float squared = std::numeric_limits<float>::max();  ///< squared distance of the point. [m^2]
  bool on_face = false;                               ///< the point's projection; otherwise on an edge or corner
};

struct Triangle {
  Vec3 centre;           ///< of a sphere round the corners. [m]
  float radius = 0;      ///< [m]
  Vec3 corners[3];       ///< [m]
  Vec3 normal;           ///< unit, by the winding
  float offset = 0;      ///< the plane is normal . p = offset. [m]
  Vec3 side[3];          ///< unit, in the plane, from the edge that starts at each corner into the triangle
  float side_offset[3];  ///< of the edges' planes. [m]
  std::uint32_t id = 0;  ///< the same from step to step
  /// Whether the sheet goes on beyond each edge, bent by at most 15 degrees. Only of solid bodies' queries.
  bool goes_on[3] = {};

  /// Computes in double: planes of very large triangles must be accurate near the origin.
  /// @return false for corners that lie on a line or farther than 1e15 m, or are not finite
  bool set(const double (&p)[3][3]) noexcept;

  /// Height over the plane, along the normal. [m]
  [[nodiscard]] float height(Vec3 p) const noexcept { return dot(normal, p) - offset; }
  /// The place below a point, if it lies over the triangle.
  [[nodiscard]] NearestPlace below(Vec3 p) const noexcept {
    const float h = height(p);
    return {p - h * normal, h * h, true};
  }
  /// How far a point lies beyond the farthest edge, in the plane; 0 over the triangle. [m]
  [[nodiscard]] float beyond(Vec3 p) const noexcept {
    float most = 0;
    for (int i = 0; i < 3; ++i) {
      const float past = side_offset[i] - dot(side[i], p);
      most = past > most ? past : most;
    }
    return most;
  }
  /// Lower bound of the squared distance; exact except near corners. [m^2]
  [[nodiscard]] float least_squared(Vec3 p) const noexcept {
    const float h = height(p);
    const float e = beyond(p);
    return h * h + e * e;
  }
  [[nodiscard]] bool is_within(Vec3 p, float reach) const noexcept {
    const Vec3 away = p - centre;
    return dot(away, away) <= (reach + radius) * (reach + radius) && least_squared(p) <= reach * reach;
  }
  [[nodiscard]] NearestPlace nearest(Vec3 p) const noexcept;
};

/// The triangle nearest to p, and the nearest place on it; null if none is nearer than `place`.
/// @param list  of what `triangle_of` takes to a triangle
template <class List, class TriangleOf>
const Triangle* nearest_triangle(const List& list, const TriangleOf& triangle_of, Vec3 p, NearestPlace& place) {
  const Triangle* best = nullptr;
  for (const auto& one : list) {
    const Triangle& triangle = triangle_of(one);
    if (!(triangle.least_squared(p) < place.squared)) continue;
    const NearestPlace found = triangle.nearest(p);
    if (!(found.squared < place.squared)) continue;
    place = found;
    best = &triangle;
  }
  return best;
}

/// Spheres side by side; what lies beyond those that are set means nothing.
struct Spheres {
  static constexpr std::uint32_t kMost = 16;
  alignas(64) float x[kMost] = {};
  alignas(64) float y[kMost] = {};
  alignas(64) float z[kMost] = {};      ///< centres. [m]
  alignas(64) float reach[kMost] = {};  ///< of a triangle from the centre. [m]

  void set(std::uint32_t k, Vec3 centre, float farthest) noexcept {
    x[k] = centre.x, y[k] = centre.y, z[k] = centre.z;
    reach[k] = farthest;
  }
};
/// Compares spheres with listed triangles.
/// @param masks  for each of the list: bit k is Triangle::is_within of sphere k
/// @param least  for each sphere: the least Triangle::least_squared of the list. [m^2]
void find_within(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& spheres,
                 std::span<std::uint16_t> masks, float (&least)[Spheres::kMost]);

/// Of places side by side: the nearest of listed triangles.
struct NearestFaces {
  static constexpr std::uint32_t kNone = ~0U;
  alignas(64) float squared[Spheres::kMost];         ///< no triangle is nearer. [m^2]
  alignas(64) float beyond[Spheres::kMost];          ///< 0: the place lies over the triangle. [m]
  alignas(64) std::uint32_t number[Spheres::kMost];  ///< of the triangle; kNone if none is in reach
};
/// Where a place lies over its triangle, `nearest_triangle` gives the same one, or one that is as near.
/// @param places  the spheres' centres
/// @param reach   the farthest that counts. [m]
void find_nearest_faces(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& places,
                        float reach, NearestFaces& out);

}  // namespace vps::detail

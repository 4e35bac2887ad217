// SPDX-License-Identifier: Zlib
/// @file Triangles of Bullet's meshes, prepared for the distances of many points. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <vector>

#include "runtime/fields/penetration.h"

namespace vps::bullet {

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
  [[nodiscard]] float height(Vec3 p) const noexcept { return detail::dot(normal, p) - offset; }
  /// How far a point lies beyond the farthest edge, in the plane; 0 over the triangle. [m]
  [[nodiscard]] float beyond(Vec3 p) const noexcept {
    float most = 0;
    for (int i = 0; i < 3; ++i) {
      const float past = side_offset[i] - detail::dot(side[i], p);
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
    using detail::operator-;
    const Vec3 away = p - centre;
    return detail::dot(away, away) <= (reach + radius) * (reach + radius) && least_squared(p) <= reach * reach;
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

/// Spheres side by side.
struct Spheres {
  static constexpr std::uint32_t kMost = 16;
  float x[kMost] = {}, y[kMost] = {}, z[kMost] = {};  ///< centres. [m]
  float reach[kMost] = {};                            ///< of a triangle from the centre. [m]

  void set(std::uint32_t k, Vec3 centre, float farthest) noexcept {
    x[k] = centre.x, y[k] = centre.y, z[k] = centre.z;
    reach[k] = farthest;
  }
};
/// Bit k: Triangle::is_within of sphere k. Bits of spheres that are not set mean nothing.
[[nodiscard]] std::uint16_t within_reach(const Triangle& triangle, const Spheres& spheres) noexcept;

/// A triangle as a mesh passes it to a callback. It has no padding, so that its bytes can be hashed.
struct MeshTriangle {
  btScalar corners[3][3];
  std::int32_t part, index;
};

/// Working memory of a thread.
struct Sheets {
  std::vector<MeshTriangle> mesh;
  std::vector<Triangle> triangles;
  struct Edge {
    Vec3 ends[2];
    std::uint32_t triangle = 0, side = 0;
  };
  std::vector<Edge> edges;
  bool are_joined = false;           ///< the triangles know where the sheet goes on
  std::vector<std::uint32_t> near;   ///< numbers of the triangles that are searched
  std::vector<std::uint8_t> met;     ///< bit k: corner k of the triangle has been tested
  std::vector<std::uint32_t> lists;  ///< a stack of lists, one for each node on the way down
  std::vector<std::uint16_t> masks;  ///< a stack, too: of a node's list, what `within_reach` says of its children
};

/// Empty at first. [m]
struct Box {
  double low[3] = {1e300, 1e300, 1e300};
  double high[3] = {-1e300, -1e300, -1e300};

  /// Adds a cube with its half edge.
  void add(Vec3 centre, float half) noexcept {
    const float c[3] = {centre.x, centre.y, centre.z};
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], double{c[i] - half});
      high[i] = std::max(high[i], double{c[i] + half});
    }
  }
  /// Whether it meets the box of two places.
  [[nodiscard]] bool meets(Vec3 a, Vec3 b) const noexcept {
    const float p[3] = {a.x, a.y, a.z};
    const float q[3] = {b.x, b.y, b.z};
    for (int i = 0; i < 3; ++i) {
      if (double{std::max(p[i], q[i])} < low[i] || double{std::min(p[i], q[i])} > high[i]) return false;
    }
    return true;
  }
};

/// Bounds of a box of another frame, in the mesh's frame.
/// @param to_frame  takes the mesh's frame to the box's frame
void turn_box(const Box& box, const Pose& to_frame, btVector3& low, btVector3& high);

/// Fills `sheets.mesh` with a mesh's triangles in a box of its frame.
/// @return their hash
std::uint64_t gather(const btConcaveShape& mesh, const btVector3& low, const btVector3& high, Sheets& sheets);

/// Fills `sheets.triangles` with those of `sheets.mesh` that meet a box of another frame, in that frame. Triangles
/// without area or with corners that are not finite are left out.
void place(const Pose& to_frame, const Box& box, Sheets& sheets);

/// Sets `goes_on` of the triangles.
void join(Sheets& sheets);

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file The triangles of Bullet's meshes near a body. Internal.
#pragma once

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include <vector>

#include "runtime/fields/triangle.h"

namespace vps::bullet {

using detail::NearestPlace;
using detail::Triangle;

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
  std::vector<std::uint16_t> masks;  ///< a stack, too: of a node's list, what `find_within` says of its children
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

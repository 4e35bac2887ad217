// SPDX-License-Identifier: Zlib
/// @file A solid body at a part of a sheet of triangles, for the search of contacts and the test of flat nodes. All in
/// the body's asset frame. Internal.
#pragma once

#include <span>

#include "runtime/bullet/partners/triangles.h"

namespace vps::bullet {

/// The body that gives the shell, and its field.
struct SolidBody {
  /// Cosine. Where the sheet's plane and the body's surface make a larger angle, no face gives the direction.
  static constexpr float kAligned = 0.5F;
  /// Cosine. Where they make a smaller angle, the shell's normal alone says where the material is.
  static constexpr float kFacing = 0.966F;
  /// Cosine. Where they make a larger angle, neither side of the sheet has more of the body's material than the other.
  static constexpr float kUpright = 0.05F;
  /// The body has no material where its field is farther outside. [voxels]
  static constexpr float kOutside_vx = 0.1F;

  const PointshellView& shell;
  const VoxelmapView& map;
  float voxel;  ///< [m]

  /// V, positive inside. [m]
  /// @pre the body has a field; so for `side_of` and `is_beyond`
  [[nodiscard]] float penetration_at(Vec3 p) const noexcept {
    return vps::penetration(map, p, map.field == Field::layers ? outward_normal(map, p) : Vec3());
  }

  /// Cosine of the angle between the inward normal at a point of the shell and a triangle's normal.
  [[nodiscard]] float facing(std::uint32_t point, const Triangle& triangle) const noexcept {
    return detail::dot(point_inward_normal(shell, point), triangle.normal);
  }

  /// The side of a triangle's plane on which the body's material is, at a place of its surface: 1 along the normal, -1
  /// against it, 0 for neither.
  /// @param along  cosine of the angle between the body's inward normal and the triangle's
  [[nodiscard]] float side_of(const Triangle& triangle, Vec3 p, float along) const noexcept {
    using namespace detail;
    if (std::abs(along) > kFacing) return along > 0 ? 1 : -1;
    if (std::abs(along) < kUpright) return 0;
    const float above = penetration_at(p + voxel * triangle.normal);
    const float below = penetration_at(p - voxel * triangle.normal);
    // A face, edge or corner that points to one side of the sheet has no material of the body on that side.
    if (!(std::min(above, below) <= -kAligned * voxel) || !(std::abs(above - below) > 0.5F * kAligned * voxel)) {
      return 0;
    }
    return above > below ? 1 : -1;
  }

  /// Whether the sheet lies beyond the body's opposite side, seen from a point of the shell: the way out is shorter the
  /// other way. On the shell V is about 0, and it changes by no more than the way.
  /// @param direction  into the body at the point
  [[nodiscard]] bool is_beyond(Vec3 p, Vec3 direction, float penetration) const noexcept {
    using namespace detail;
    const float way = 2 * penetration;
    const float outside = kOutside_vx * voxel;
    return way > outside && penetration_at(p + way * direction) < -outside;
  }
};

/// The triangles near a node of the shell.
struct SheetPart {
  Sheets& sheets;
  std::span<const std::uint32_t> list = {};  ///< of sheets.triangles
  float reach = 0;                           ///< points and triangles farther apart are not paired. [m]

  /// The list's triangle that is nearest to p, and the nearest place on it; null if none is within `farthest`.
  const Triangle* nearest(Vec3 p, float farthest, NearestPlace& place) const noexcept {
    place.squared = farthest * farthest;
    const auto listed = [this](std::uint32_t number) -> const Triangle& { return sheets.triangles[number]; };
    return nearest_triangle(list, listed, p, place);
  }

  /// Whether the sheet goes on beyond a side of one of its triangles.
  [[nodiscard]] bool goes_on(const Triangle& triangle, int side) const {
    if (!sheets.are_joined) join(sheets);
    return triangle.goes_on[side];
  }
};

}  // namespace vps::bullet

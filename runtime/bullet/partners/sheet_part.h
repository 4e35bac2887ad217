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
  /// Where V on both sides of the sheet differs by less, neither has more of the material. [voxels]
  static constexpr float kApart = 0.5F * kAligned;
  /// The body has no material where its field is farther outside. [voxels]
  static constexpr float kOutside_vx = 0.1F;

  const PointshellView& shell;
  const VoxelmapView& map;
  float voxel;  ///< [m]

  [[nodiscard]] bool has_field() const noexcept { return map.field != Field::none; }
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
    if (!needs_sides(along)) return side_by_normal(along);
    return side_between(penetration_at(p + voxel * triangle.normal), penetration_at(p - voxel * triangle.normal));
  }
  /// Whether `side_of` needs V on both sides of the triangle.
  [[nodiscard]] static bool needs_sides(float along) noexcept {
    return std::abs(along) <= kFacing && std::abs(along) >= kUpright;
  }
  [[nodiscard]] static float side_by_normal(float along) noexcept {
    if (std::abs(along) < kUpright) return 0;
    return along > 0 ? 1 : -1;
  }
  /// @param above,below  V a voxel along the triangle's normal and against it. [m]
  [[nodiscard]] float side_between(float above, float below) const noexcept {
    // A face, edge or corner that points to one side of the sheet has no material of the body on that side.
    if (!(std::min(above, below) <= -kAligned * voxel) || !(std::abs(above - below) > kApart * voxel)) return 0;
    return above > below ? 1 : -1;
  }
  /// Whether `side_between` is the same for values that are off as those of PlacedField may be.
  [[nodiscard]] bool are_clear(float above, float below) const noexcept {
    constexpr float kOff_vx = 1e-3F;
    const float off = kOff_vx * voxel;
    // Beyond the band they may be off by more.
    return std::min(above, below) > -detail::end_of_band(map.band_outer, map.voxel_size) + off &&
           std::abs(std::min(above, below) + kAligned * voxel) > off &&
           std::abs(std::abs(above - below) - kApart * voxel) > off;
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

  /// The triangle within reach that is nearest to p, if p lies over it; else null. As `find_nearest_faces`.
  [[nodiscard]] const Triangle* face_over(Vec3 p) const noexcept {
    const Triangle* nearest = nullptr;
    float least = reach * reach;
    for (const std::uint32_t number : list) {
      const Triangle& triangle = sheets.triangles[number];
      const float squared = triangle.least_squared(p);
      if (!(squared < least)) continue;
      least = squared;
      nearest = &triangle;
    }
    return nearest != nullptr && !(nearest->beyond(p) > 0) ? nearest : nullptr;
  }

  /// Whether the sheet goes on beyond a side of one of its triangles.
  [[nodiscard]] bool goes_on(const Triangle& triangle, int side) const {
    if (!sheets.are_joined) join(sheets);
    return triangle.goes_on[side];
  }
};

}  // namespace vps::bullet

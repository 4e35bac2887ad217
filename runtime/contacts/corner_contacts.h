// SPDX-License-Identifier: Zlib
/// @file Contacts at the corners of polyhedra, which may lie between the points of a shell. Internal.
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// The corners of a hull with more are facets of something round: contacts there would brake its rolling on slopes.
inline constexpr std::uint32_t kMostCorners = 16;

/// Corners of a solid in its own frame.
struct Corners {
  std::span<const Vec3> places;       ///< [m]
  float margin = 0;                   ///< by which it is rounded. [m]
  std::span<const float> radii = {};  ///< of balls around the places, instead of the margin; empty: none. [m]

  [[nodiscard]] float rounding(std::size_t i) const noexcept { return radii.empty() ? margin : radii[i]; }
};

/// Which corners are contacts.
struct CornerReach {
  float least = 0;   ///< V of a corner, without the margin. [m]
  float margin = 0;  ///< added to V. [m]
};
/// Appends the contact of a corner, if it reaches. It is final.
/// @param map     distances of the shell's body
/// @param corner  body's frame; the contact's too. [m]
/// @param number  the contact's `point`: no point of the shell
void add_corner_contact(const VoxelmapView& map, const Transform& to_map, Vec3 corner, CornerReach reach,
                        std::uint32_t number, std::vector<Contact>& contacts);

/// Appends a contact for each corner that is in the voxelmap of the shell's body or near it. Such contacts are final,
/// and their `point` is no point of the shell.
/// @param map       distances of the shell's body
/// @param to_map    takes the polyhedron's frame to the map's
/// @param reach     largest distance of a contact off the surface. [m]
/// @param contacts  polyhedron's frame
/// @return whether there are any
bool add_corner_contacts(const VoxelmapView& map, const PointshellView& shell, const Transform& to_map,
                         const Corners& corners, float reach, std::vector<Contact>& contacts);

/// V that a point of the shell must exceed to be a contact beside those of corners. Three corners that touch carry the
/// polyhedron, with the normals of the shell's body: points only count if they are deeper, as on a bump. In the same
/// way corners of a baked body beside the points of another one. [m]
/// @param near  distance at which a corner touches. [m]
template <class Contacts>
float least_beside(const Contacts& corners, float near) noexcept {
  float deepest = -near;
  int touching = 0;
  for (const auto& corner : corners) {
    if (corner.penetration < -near) continue;
    deepest = std::max(deepest, corner.penetration);
    ++touching;
  }
  return touching >= 3 ? deepest + near : -std::numeric_limits<float>::infinity();
}

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Contacts at the corners of Bullet's polyhedra, which may lie between the points of a shell. Internal.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/pair.h"
#include "runtime/fields/place_field.h"

namespace vps::bullet {

/// The corners of a hull with more are facets of something round: contacts there would brake its rolling.
inline constexpr std::uint32_t kMostCorners = 16;

/// Appends a contact for each corner of a box or a hull of few corners that is in the voxelmap of the shell's body or
/// near it. Such contacts are final, and their `point` is no point of the shell.
/// @param frame     of the polyhedron, in the world
/// @param reach     largest distance of a contact off the surface. [m]
/// @param contacts  polyhedron's frame
/// @return whether there are any
bool add_corner_contacts(const Pair& pair, const btTransform& frame, float reach, std::vector<Contact>& contacts);

/// Penetration of a point into a map and the direction out of it, also far outside the band of its samples.
struct MapPlace {
  float penetration = 0;  ///< [m]
  Vec3 outward;           ///< unit; zero where the map has no slope
  bool is_far = false;    ///< beyond the band: by a walk to the surface
};
MapPlace place_in_map(const VoxelmapView& map, Vec3 point);

}  // namespace vps::bullet

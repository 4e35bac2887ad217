// SPDX-License-Identifier: Zlib
/// @file A baked shape against Bullet's spheres: its distance field at the sphere's centre. Internal.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/pair.h"

namespace vps::bullet {

/// The sphere in the asset frame of the baked shape.
struct SphereInMap {
  Vec3 centre;       ///< [m]
  float radius = 0;  ///< [m]
};

/// Whether find_sphere_contacts serves a pair: the shape has distances, and the sphere is no larger than the shape. On
/// a larger one, such as a planet, bodies stand on their points as on a plane.
[[nodiscard]] bool takes_sphere(const Shape& shape, float radius);

/// Contacts between a sphere and the surface of a voxelmap: at the surface point nearest to the centre, and on
/// faces of other directions that the sphere touches too, as in a groove. Unlike the points of the shell, they
/// change continuously as the sphere moves.
/// @param map    with scaled or real distances
/// @param seeds  contacts of the shell's points with the sphere, asset frame: where other faces may be. Reordered
/// @param reach  largest distance of a contact off the surface. [m]
/// @param found  replaced; asset frame, final direction; `point` numbers the nearest one as no point of the shell
/// @return false, and no change, where the nearest point is not found
bool find_sphere_contacts(const VoxelmapView& map, const SphereInMap& sphere, std::span<Contact> seeds, float reach,
                          std::uint32_t shell_points, std::vector<Contact>& found);

}  // namespace vps::bullet

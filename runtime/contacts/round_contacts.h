// SPDX-License-Identifier: Zlib
/// @file A baked body against spheres and capsules: its distance field at their centres. Internal.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// A sphere or capsule.
struct Round {
  Vec3 half_axis;    ///< from the centre to that of one end; zero: a sphere. Field's frame. [m]
  float radius = 0;  ///< [m]
};
/// None for other fields.
[[nodiscard]] std::optional<Round> round_of(FieldRef field) noexcept;

/// A sphere or capsule in the asset frame of the baked body.
struct RoundInMap {
  Vec3 centre;       ///< [m]
  Vec3 half_axis;    ///< from the centre to that of one end; zero: a sphere. [m]
  float radius = 0;  ///< [m]
};

/// Whether find_round_contacts serves a pair: the baked body has distances, and the radius is no larger than that body.
/// On a larger sphere, such as a planet, bodies stand on their points as on a plane.
[[nodiscard]] bool takes_round(const VoxelmapView& map, float radius) noexcept;

/// Contacts between a sphere or capsule and the surface of a voxelmap: at the surface points nearest to the centre of
/// each end, and to the axis between them where the body is deeper there. And on faces of other directions that it
/// touches too, as in a groove. Unlike the points of the shell, they change continuously as the body moves.
/// @param map    with scaled or real distances
/// @param seeds  contacts of the shell's points with the body, asset frame: where other faces may be. Reordered
/// @param reach  largest distance of a contact off the surface. [m]
/// @param found  replaced; asset frame, final direction; `point` numbers the nearest ones as no points of the shell
/// @return false, and nothing in `found`, where no nearest point is found
bool find_round_contacts(const VoxelmapView& map, const RoundInMap& body, std::span<Contact> seeds, float reach,
                         std::uint32_t shell_points, std::vector<Contact>& found);

}  // namespace vps::detail

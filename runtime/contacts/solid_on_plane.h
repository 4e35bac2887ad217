// SPDX-License-Identifier: Zlib
/// @file Contacts of a convex solid with baked ground that is flat below it. Internal.
#pragma once

#include <optional>
#include <vector>

#include "runtime/contacts/step_pair.h"

namespace vps::detail {

/// Finds the contacts of a solid where the shell's body is flat around it, as flat_ground: its outermost places meet
/// the plane, and no sample is looked up. One that stands on ground with slots, and moves along it, meets the plane
/// over its tops: at places of its face that have ground below them. Contacts are final, and their `point` is no point
/// of the shell.
/// @param partner   a sphere, a capsule, a cylinder, a cone, or a polyhedron with corners; nothing is done for others
/// @param distance  largest distance of a contact off the surface. [m]
/// @param contacts  empty on entry; partner's frame
/// @return upper bound of the V of all points of the shell in the solid, within `distance` [m]; nothing: the ground is
///         not flat there and it does not stand there, or a hull of many corners rolls over it
std::optional<float> add_contacts_on_plane(const StepPair& pair, const Partner& partner, float distance,
                                           PairMemory& memory, std::vector<Contact>& contacts);

}  // namespace vps::detail

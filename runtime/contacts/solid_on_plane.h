// SPDX-License-Identifier: Zlib
/// @file Contacts of a convex solid with baked ground that is flat below it. Internal.
#pragma once

#include <optional>
#include <vector>

#include "runtime/contacts/step_pair.h"

namespace vps::detail {

/// Appends the contacts of a solid where the shell's body is flat around it, as flat_ground: its outermost places meet
/// the plane, and no sample is looked up. They are final, and their `point` is no point of the shell.
/// @param partner   a sphere, a capsule, a cylinder, a cone, or a polyhedron with corners; nothing is done for others
/// @param distance  largest distance of a contact off the surface. [m]
/// @param contacts  partner's frame
/// @return upper bound of the V of all points of the shell in the solid, within `distance` [m]; nothing: the ground is
///         not flat there
std::optional<float> add_contacts_on_plane(const StepPair& pair, const Partner& partner, float distance,
                                           GroundMemory& memory, std::vector<Contact>& contacts);

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Contacts ahead of bodies that move far in a step. Internal.
#pragma once

#include "runtime/bullet/find_contacts.h"

namespace vps::bullet {

/// How far the surfaces of a pair may approach each other in a step, where that is more than a voxel: contacts are
/// looked for as far ahead, so that the solver stops a body at the surface and not behind it. Else 0, and where
/// restitution is wanted, which a contact ahead would lose. [m]
[[nodiscard]] btScalar approach(const Pair& pair, btScalar step);

/// Takes out what is ahead but not met in the step: the nearest place of a surface is not where a point arrives that
/// flies past an edge. The others get the direction and the gap of where they arrive. Contacts with triangle meshes are
/// left as they are.
void keep_arriving(const Pair& pair, btScalar step, PairMemory& memory, FoundContacts& found);

}  // namespace vps::bullet

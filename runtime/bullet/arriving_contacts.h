// SPDX-License-Identifier: Zlib
/// @file Contacts ahead of bodies that move far in a step. Internal.
#pragma once

#include "runtime/bullet/find_contacts.h"

namespace vps::bullet {

/// How far the surfaces of a pair may approach each other in a step.
struct Approach {
  enum class Phase : std::uint8_t { resting, landing };
  btScalar way = 0;              ///< where it is more than a voxel, else 0. [m]
  Phase phase = Phase::resting;  ///< landing: the way is longer than forces make it in five steps from rest
};

/// Contacts are looked for as far ahead as that, so that the solver stops a body at the surface and not behind it. Not
/// where restitution is wanted, which a contact ahead would lose: there the way is 0.
[[nodiscard]] Approach approach(const Pair& pair, btScalar step);

/// Takes out what is ahead but not met in the step: the nearest place of a surface is not where a point arrives that
/// flies past an edge. The others get the direction and the gap of where they arrive. Contacts with triangle meshes are
/// left as they are.
void keep_arriving(const Pair& pair, btScalar step, PairMemory& memory, FoundContacts& found);

}  // namespace vps::bullet

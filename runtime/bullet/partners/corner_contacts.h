// SPDX-License-Identifier: Zlib
/// @file Contacts at the corners of Bullet's polyhedra, which may lie between the points of a shell. Internal.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/pair.h"
#include "runtime/contacts/corner_contacts.h"

namespace vps::bullet {

/// Those of a box or a hull of few corners, see detail::add_corner_contacts.
/// @param frame     of the polyhedron, in the world
/// @param reach     largest distance of a contact off the surface. [m]
/// @param contacts  polyhedron's frame
/// @return whether there are any
bool add_corner_contacts(const Pair& pair, const btTransform& frame, float reach, std::vector<Contact>& contacts);

}  // namespace vps::bullet

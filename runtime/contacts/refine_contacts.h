// SPDX-License-Identifier: Zlib
/// @file Gives the contacts of a pair their final direction and penetration. Internal. Paper: Sec. 2.3.
#pragma once

#include "runtime/contacts/find_contacts.h"

namespace vps::detail {

/// Sets the final direction of contacts, along which the shell's body is pushed, and projects their area along it. At
/// edges and corners the shell's normal is an average of its faces' normals. As a contact normal it pushes sideways,
/// and in Eq. (4), as evaluated on layers, it gives a wrong penetration. The field's normal is better in both cases.
/// The shell's is used at the field's edges, and where the field has no normal. Contacts that would stop a body sliding
/// past an edge are removed.
/// @param contacts  some of those that were found
/// @return number of contacts left; they come first
std::size_t refine(const StepPair& pair, const Partner& partner, const FoundContacts& found,
                   std::span<ManifoldContact> contacts);

/// Whether contacts with a map need no refining: the pair stands still, and `move_between_samples` knows where they
/// slid and their directions. If so, sets their areas.
/// @param contacts  those of the pair that were chosen
bool are_refined(const StepPair& pair, const Partner& partner, const FoundContacts& found, const PairMemory& memory,
                 std::span<ManifoldContact> contacts);

/// The same as `refine` for all contacts with a convex body. Its planes only bound it: its nearest face, edge or corner
/// gives the contact.
/// @param reach  largest distance of a contact off the surface, with the margins. [m]
void finish_convex(const StepPair& pair, const Partner& partner, float reach, FoundContacts& found);

/// Moves contacts from the points of the shell to where the bodies overlap most, see Slides.
/// @param contacts  refined; distances of shells without a voxelmap are not known, their contacts stay as they are
/// @return number of contacts left; they come first, in their order
std::size_t move_between_samples(const StepPair& pair, const Partner& partner, const FoundContacts& found,
                                 PairMemory& memory, Workspace& space, std::span<ManifoldContact> contacts);

}  // namespace vps::detail

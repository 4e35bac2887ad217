// SPDX-License-Identifier: Zlib
/// @file Contacts at the corners of a baked body in the one that gives its points. Internal.
#pragma once

#include "runtime/contacts/arriving_contacts.h"

namespace vps::detail {

struct CornersQuery {
  float distance = 0;  ///< surfaces up to this far apart are in contact, with the margins. [m]
  float least = 0;     ///< V that a corner must exceed, with the margins: see least_beside. [m]
  float way = 0;       ///< as FoundContacts::way
  bool is_joint = false;
  std::size_t most = 4;  ///< contacts
};

/// Minus the way by which the shell's body has to move before a corner of the other one may be in it, or more. Corners
/// beyond the shell's ball move farther than the ball in the same motion.
/// @param least  more is not asked for. [m]
[[nodiscard]] float most_of_corners(const StepPair& pair, const VoxelmapView& map, float least);

/// Finds the corners of the other body that meet the shell's body. The points of a face are too far apart to find a
/// corner in time, and V at points beside a corner is its distance from the sides: at a cube's corner 0.58 of the
/// depth.
/// @param map     of the other body
/// @param memory  of the corners: a bound of V at all of them
/// @param out     gets the contacts, in the field's frame, with final directions
void add_contacts_of_corners(const StepPair& pair, const VoxelmapView& map, const CornersQuery& query,
                             CornerMemory& memory, Workspace& space, std::vector<ManifoldContact>& out);

}  // namespace vps::detail

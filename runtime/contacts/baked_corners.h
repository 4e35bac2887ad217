// SPDX-License-Identifier: Zlib
/// @file Contacts at the corners of a baked body in another one that gives its points. Internal.
#pragma once

#include "runtime/contacts/arriving_contacts.h"

namespace vps::detail {

struct CornersQuery {
  float distance = 0;      ///< surfaces up to this far apart are in contact, without the margins. [m]
  float least = 0;         ///< V that a corner must exceed, with the margins: see least_beside. [m]
  Approach approach = {};  ///< of the pair
  std::size_t most = 4;    ///< contacts
};

/// Finds the corners of the pair's shell that meet the other body. The points of that body's faces are too far apart to
/// find a corner in time, and V at points beside a corner is its distance from the sides: at a cube's corner 0.58 of
/// the depth.
/// @param map     distances of the other body
/// @param memory  of the corners alone
/// @return in the field's frame, with final directions; until the workspace's next use
std::span<ManifoldContact> contacts_of_corners(const StepPair& pair, const VoxelmapView& map, const CornersQuery& query,
                                               PairMemory& memory, Workspace& space);

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Contacts at the places between the shell's points where the bodies overlap most. Internal.
#pragma once

#include "runtime/bullet/find_contacts.h"

namespace vps::bullet {

/// Moves contacts from the points of the shell to where the bodies overlap most, see detail::Slides.
/// @param contacts  refined; distances of shells without a voxelmap are not known, their contacts stay as they are
/// @return number of contacts left; they come first, in their order
std::size_t move_between_samples(const Pair& pair, const FoundContacts& found, PairMemory& memory,
                                 std::span<ManifoldContact> contacts);

}  // namespace vps::bullet

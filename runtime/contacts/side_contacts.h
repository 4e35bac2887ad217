// SPDX-License-Identifier: Zlib
/// @file The contacts of one body's points in the other body for a step: finds, chooses, refines. Internal. Paper:
/// Secs. 2.4 and 3.2.
#pragma once

#include "runtime/contacts/arriving_contacts.h"

namespace vps::detail {

struct SideQuery {
  float distance = 0;         ///< surfaces up to this far apart are in contact, without the margins. [m]
  bool leaves_faces = false;  ///< see QueryOptions
  std::span<const FlatPatch> flat_patches = {};  ///< of the shell, for springs
  Approach approach = {};                        ///< of the pair
  std::span<const std::uint32_t> previous = {};  ///< features of the last step's contacts, at most four
  std::size_t most = 4;                          ///< contacts; with segments, kContactsPerSegment for each
};

struct SideContacts {
  std::span<ManifoldContact> contacts;  ///< in order of their slots; until the workspace's next use
  bool in_shell_frame = false;          ///< else in the field's
  float reach = 0;                      ///< largest distance of a contact off the surface. [m]
};

/// The one way from a pair to its contacts. Throws std::bad_alloc.
Status contacts_of_side(const StepPair& pair, const Partner& partner, const SideQuery& query, PairMemory& memory,
                        Workspace& space, SideContacts& out);

/// Chooses up to `most` contacts: four by choose_four, then those that are deep and far from others.
/// @return their rows, in space.chosen
std::span<const std::uint32_t> choose_few(const ContactRows& rows, std::span<const std::uint32_t> previous, float alike,
                                          std::size_t most, Workspace& space);

/// How well a contact completes those chosen: deep, and far from them. One that does not touch yet carries no load,
/// however far out it lies.
/// @param squared  distance from the nearest one chosen. [m^2]
inline float worth(float penetration, float squared, float alike) noexcept {
  const float off = alike * alike * alike / (penetration * penetration + alike * alike);
  return squared * (penetration >= 0 ? penetration + alike : off);
}

}  // namespace vps::detail

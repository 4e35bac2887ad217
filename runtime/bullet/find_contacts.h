// SPDX-License-Identifier: Zlib
/// @file The contacts of a pair, whatever the partner. Internal. Paper: Secs. 2.3 and 2.4.
#pragma once

#include "runtime/bullet/manifold_contact.h"
#include "runtime/bullet/pair.h"
#include "runtime/bullet/partners/convex_planes.h"
#include "runtime/bullet/partners/triangle_contacts.h"
#include "runtime/bullet/segment_contacts.h"

namespace vps::bullet {

/// What a pair remembers from step to step.
struct PairMemory {
  ContactCache cache;
  SegmentMemory segments;
  ConvexPlanes planes;
  TriangleMemory triangles;
};

/// Working memory of a thread: pairs may run in parallel, assets are immutable.
struct Workspace {
  Scratch scratch;
  std::vector<Contact> contacts;
  TriangleContacts triangles;
  static Workspace& of_this_thread(const PointshellView& shell);
};

struct FoundContacts {
  /// In tree order. Their `inward_normal` and area are the shell's, until `refine`.
  std::span<Contact> contacts;
  std::span<const std::uint32_t> features;  ///< as feature_of takes them
  btTransform frame;                        ///< takes the contacts' frame to the world
  float reach = 0;                          ///< how far off the surface they may be. [m]

  /// Which of them have their final direction, penetration and area. `refine` leaves these as they are.
  enum class Refined : std::uint8_t {
    none,
    arriving,  ///< those farther off the surface than `arriving_beyond`
    all,
  };
  Refined refined = Refined::none;
  float arriving_beyond = 0;  ///< [m]

  [[nodiscard]] bool is_refined(const Contact& contact) const {
    return refined == Refined::all || (refined == Refined::arriving && contact.penetration < -arriving_beyond);
  }
};

/// Segmented, what the segments touched with before is tested again, but not on triangle meshes: more than one contact
/// of a node may be found.
/// @param options  of the query; the cache is set here, and the margins are added
Status find_contacts(const Pair& pair, QueryOptions options, PairMemory& memory, FoundContacts& found);

/// Gives contacts the direction that the shell's body is pushed along, and their area as seen from there. At edges and
/// corners the shell's normal is an average of its faces': as a contact normal it pushes sideways, and in Eq. (4), by
/// which layers answer, it misjudges the penetration. The field's own serves both better; but at its edges, and where
/// it has none, the shell's. Contacts that would stop a body sliding past an edge are taken out.
/// @param contacts  some of those that were found
/// @return how many are left, in front
std::size_t refine(const Pair& pair, const FoundContacts& found, std::span<ManifoldContact> contacts);

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file A pointshell against Bullet's triangle meshes and terrain. Internal.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/pair.h"
#include "runtime/bullet/partners/triangles.h"
#include "runtime/contacts/step_pair.h"

namespace vps::bullet {

/// Memory of a pair: where the sheet can be in contact while the body moves little. A changed mesh is detected.
struct TriangleMemory {
  struct Place {
    std::uint32_t node, segment;
  };
  std::vector<Place> places;  ///< in tree order: all where a contact is possible until the body has moved by `room`
  double room = 0;            ///< 0: nothing is remembered. [m]
  Pose reference, last;       ///< poses of the shell in the mesh: when `places` were found, and in the last query
  float distance = 0;         ///< contact distance of `places`. [m]
  std::uint32_t level = 0;    ///< of the segments
  const void* shell = nullptr;
  float scale = 1;                        ///< of the shell
  btVector3 low{0, 0, 0}, high{0, 0, 0};  ///< the box that was searched, mesh's frame
  std::uint64_t mesh = 0;                 ///< hash of the triangles in it
  std::span<const Triangle> near;         ///< those near the body, asset frame; until the thread's next query
};

/// Contacts of the shell with a mesh's triangles, in the shell's asset frame, in tree order.
///
/// Triangles are sheets without a solid side, and their winding is arbitrary. The body that gives the shell decides to
/// which side it is pushed: the nearer way out. With a voxelmap, the body's own field says where the material is. Where
/// the sheet ends or bends inside the body, the shell's points resolve it poorly: the contact is the deepest place of
/// the sheet there, and the direction is the field's. Without a voxelmap, the points' normals and the centre of mass
/// decide: right for bodies that are roughly convex near the contact.
///
/// @param options  contact_distance with the margins, and segment_level; the rest is not used
/// @param known    rising: only their leaves are searched, unless one of them is no longer a contact or the mesh has
///                 changed; may be empty
/// @return missing_part for a mesh that gives no triangles (btGImpactCompoundShape) or a shape without points
Status find_triangle_contacts(const Pair& pair, const QueryOptions& options,
                              std::span<const detail::ContactPlace> known, TriangleMemory& memory,
                              detail::SheetContacts& found);

}  // namespace vps::bullet

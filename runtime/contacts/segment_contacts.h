// SPDX-License-Identifier: Zlib
/// @file Chooses the contacts that the segments of a shell keep. Internal. Paper: Sec. 2.4, which keeps only the
/// deepest of each segment. That point jumps as the body rocks, no contact is left where the body comes down next, and
/// it never stops rocking.
#pragma once

#include <span>
#include <vector>

#include "runtime/contacts/manifold_contact.h"

namespace vps::detail {

/// Three points support a face.
inline constexpr int kContactsPerSegment = 3;

/// A contact that a segment keeps.
struct SegmentPoint {
  std::uint32_t node = 0, point = 0, feature = 0;
  int place = 0;                        ///< index in its segment: constant while the contact is kept
  const ManifoldContact* at = nullptr;  ///< in this step
};

/// Memory of a pair: the contacts that its segments keep.
struct SegmentMemory {
  std::vector<SegmentPoint> points, last;  ///< of this step and the one before, in tree order
  const void* shell = nullptr;
  std::uint32_t shell_points = 0, level = 0;

  /// Forgets the points when the shell or the level of the segments has changed. @param of_level  0: none
  void belong_to(const PointshellView& of_shell, std::uint32_t of_level);
};

/// Chooses the contacts that each segment keeps: its deepest point, and those kept in the last step that are still
/// contacts. A new deepest point takes the place of one closer than `beside`, else a free place, else the place of the
/// least deep; but only from one that is less deep by more than `alike`.
/// @param contacts  in tree order
/// @param beside    points closer together than this count as the same contact. [m]
/// @param alike     difference of penetrations that means nothing. [m]
/// @return memory.points
std::span<const SegmentPoint> keep_segments(std::span<const ManifoldContact> contacts, float beside, float alike,
                                            SegmentMemory& memory);

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Which contacts the segments of a shell keep, and where. Internal. Paper: Sec. 2.4, which keeps the deepest of
/// each alone: that one jumps as the body rocks, nothing is left where the body comes down next, and it rocks for ever.
#pragma once

#include <span>
#include <vector>

#include "runtime/bullet/manifold_contact.h"

namespace vps::bullet {

/// A face stands on three points.
inline constexpr int kContactsPerSegment = 3;

/// A contact that a segment keeps.
struct SegmentPoint {
  std::uint32_t node = 0, point = 0, feature = 0;
  int place = 0;                        ///< among those of its segment: the same for as long as it is kept
  const ManifoldContact* at = nullptr;  ///< in this step
};

/// What the segments of a pair touched with.
struct SegmentMemory {
  std::vector<SegmentPoint> points, last;  ///< of this step and the one before, in tree order
  const void* shell = nullptr;
  std::uint32_t shell_points = 0, level = 0;

  /// Forgets what is of another shell, or of other segments. @param of_level  0: none
  void belong_to(const PointshellView& of_shell, std::uint32_t of_level);
};

/// Chooses what each segment keeps: its deepest point, and those that it touched with before and that are near still.
/// A new deepest point takes the place of the one beside it, else of the least deep.
/// @param contacts  in tree order
/// @param beside    closer points are the same for a body. [m]
/// @return memory.points
std::span<const SegmentPoint> keep_segments(std::span<const ManifoldContact> contacts, float beside,
                                            SegmentMemory& memory);

}  // namespace vps::bullet

// SPDX-License-Identifier: Zlib
/// @file Which body of a pair gives its points for a step, and which points of the other one are needed. Internal.
/// Paper: Sec. 3.2.
#pragma once

#include "runtime/contacts/gives_pointshell.h"
#include "runtime/vps_runtime.h"

namespace vps::detail {

/// A body of a pair.
struct RoleSide {
  const PointshellView* shell = nullptr;  ///< null: it has none
  bool has_field = false;
  bool has_distances = false;  ///< for the other body's corners
  double voxel_size = 0;       ///< [m]

  [[nodiscard]] bool has_points() const noexcept { return shell != nullptr && shell->points > 0; }
  [[nodiscard]] bool has_corners() const noexcept { return shell != nullptr && shell->corners > 0; }
};

/// Which points of a pair's other body are sought in the one that gives its points.
enum class OtherGives : std::uint8_t {
  nothing,
  /// It may stand on a corner between the points of a face.
  corners,
  /// The shell has few points inside its faces, and an edge of the other body may lie between them. Then the points
  /// inside faces are not needed: what they could touch is an edge, a corner or a curved place of the other body, or
  /// another face, and faces meet at the edge of one of them first.
  all,
};

struct PairRoles {
  bool is_possible = false;  ///< whether either body can give its points to the other
  bool first_gives = true;   ///< else the second does
  OtherGives other = OtherGives::nothing;
};

/// The body that can gives its points; of two that can, see gives_pointshell.
inline PairRoles roles_of(const RoleSide& first, const RoleSide& second) noexcept {
  const bool first_can = first.has_points() && second.has_field;
  const bool second_can = second.has_points() && first.has_field;
  PairRoles roles{first_can || second_can, !second_can};
  if (first_can && second_can) {
    roles.first_gives =
        gives_pointshell({first.voxel_size, first.shell->points}, {second.voxel_size, second.shell->points});
  }
  const RoleSide& gives = roles.first_gives ? first : second;
  const RoleSide& other = roles.first_gives ? second : first;
  if (first_can && second_can && gives.shell->face_points != nullptr) {
    roles.other = OtherGives::all;
  } else if (roles.is_possible && gives.has_distances && other.has_corners()) {
    roles.other = OtherGives::corners;
  }
  return roles;
}

}  // namespace vps::detail

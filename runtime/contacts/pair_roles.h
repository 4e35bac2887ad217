// SPDX-License-Identifier: Zlib
/// @file Which body of a pair gives its points for a step, and whether both do. Internal. Paper: Sec. 3.2.
#pragma once

#include "runtime/contacts/gives_pointshell.h"
#include "runtime/vps_runtime.h"

namespace vps::detail {

/// A body of a pair.
struct RoleSide {
  const PointshellView* shell = nullptr;  ///< null: it has none
  bool has_field = false;
  double voxel_size = 0;  ///< [m]

  [[nodiscard]] bool has_points() const noexcept { return shell != nullptr && shell->points > 0; }
};

struct PairRoles {
  bool is_possible = false;  ///< whether either body can give its points to the other
  bool first_gives = true;   ///< else the second does
  /// Whether each body's points are sought in the other one: the shell has few points inside its faces, and an edge of
  /// the other body may lie between them. Then the points inside faces are not needed: what they could touch is an
  /// edge, a corner or a curved place of the other body, or another face, and faces meet at the edge of one of them
  /// first.
  bool both_give = false;
};

/// The body that can gives its points; of two that can, see gives_pointshell.
inline PairRoles roles_of(const RoleSide& first, const RoleSide& second) noexcept {
  const bool first_can = first.has_points() && second.has_field;
  const bool second_can = second.has_points() && first.has_field;
  if (!first_can || !second_can) return {first_can || second_can, !second_can, false};
  const bool first_gives =
      gives_pointshell({first.voxel_size, first.shell->points}, {second.voxel_size, second.shell->points});
  return {true, first_gives, (first_gives ? first : second).shell->face_points != nullptr};
}

}  // namespace vps::detail

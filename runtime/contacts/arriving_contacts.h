// SPDX-License-Identifier: Zlib
/// @file Speculative contacts of bodies that move far in a step. Internal.
#pragma once

#include <cmath>

#include "runtime/contacts/find_contacts.h"

namespace vps::detail {

/// How far the surfaces of a pair may approach each other in a step.
struct Approach {
  enum class Phase : std::uint8_t { still, resting, landing };
  float way = 0;  ///< upper bound if it is more than a voxel, else 0. [m]
  /// Whether the bodies move together. The solver may stop one of them in the step: `way` is also that of each body
  /// alone, up to the fall of five steps.
  bool is_joint = false;
  /// Still: the way is at most a voxel longer than after one step from rest, and that is at most two voxels. Landing:
  /// more than a voxel longer than after five.
  Phase phase = Phase::still;
};

/// For bodies that are not slow.
[[nodiscard]] Approach fast_approach(const StepMotion& first, const StepMotion& second, double voxel_size) noexcept;

/// Speculative contacts are sought up to this far ahead, so that the solver stops a body at the surface and not behind
/// it. It does not depend on the order of the bodies.
/// @param voxel_size  the smaller one of the two. [m]
[[nodiscard]] inline Approach approach(const StepMotion& first, const StepMotion& second, double voxel_size) noexcept {
  // Most bodies are slow, and an upper bound of a length is cheaper than the length.
  const auto bound = [](Vec3 v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
  const float way =
      bound(first.way) + bound(second.way) + bound(first.turn) * first.radius + bound(second.turn) * second.radius;
  return way <= static_cast<float>(voxel_size) ? Approach() : fast_approach(first, second, voxel_size);
}
/// How far the bodies of a pair may fall in a step before the four contacts of a manifold are too few: they may all lie
/// on one side, and the body would tip through the ground. [vx]
inline constexpr float kLongFall_vx = 2;

/// The way is 0 for a pair without motions.
[[nodiscard]] inline Approach approach(const StepPair& pair) noexcept {
  const bool moves = pair.shell_motion != nullptr && pair.field_motion != nullptr;
  return moves ? approach(*pair.shell_motion, *pair.field_motion, pair.voxel_size) : Approach();
}

/// Motion of the shell in the step, relative to the field's body, contacts' frame.
[[nodiscard]] RelativeMotion motion_of(const StepPair& pair, const FoundContacts& found) noexcept;

/// Removes speculative contacts that do not close in the step: a point that flies past an edge does not arrive at the
/// nearest place of the surface. The others get the direction and the gap of the place where they arrive. Of bodies
/// that move together those stay that close if one of the two is stopped. Contacts with sheets are left as they are.
/// @pre the pair has motions
void keep_arriving(const StepPair& pair, const Partner& partner, FoundContacts& found);

}  // namespace vps::detail

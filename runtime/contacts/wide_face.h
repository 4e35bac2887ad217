// SPDX-License-Identifier: Zlib
/// @file A partner that is flat as far as the shell reaches. Internal.
#pragma once

#include <optional>

#include "runtime/contacts/step_pair.h"

namespace vps::detail {

/// How flat a baked surface has to be.
enum class FaceIs : std::uint8_t {
  even,  ///< its bound for the region is tight: no part of it rises above the others by more than a voxel
  flat   ///< by more than a twentieth of a voxel
};

/// The outward normal of a plane, of the face of a box that is wider than the shell, or of a baked surface around the
/// shell. Field's frame. Else nothing.
/// @param distance  that the shell may move, and up to which its points are sought. [m]
/// @param cache     keeps the bound of the region
std::optional<Vec3> wide_face(const StepPair& pair, const Partner& partner, float distance, FaceIs how,
                              ContactCache& cache);

/// The plane that stands for a voxelmap near a shell: its surface is flat below it, and nothing else is nearer. V of
/// points differs by a tenth of a voxel at most, and by the field's error. Field's frame. Else nothing.
/// @param distance, cache  as above
std::optional<HalfSpaceField> flat_ground(const StepPair& pair, const Partner& partner, float distance,
                                          ContactCache& cache);

}  // namespace vps::detail

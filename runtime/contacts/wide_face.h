// SPDX-License-Identifier: Zlib
/// @file A partner that is flat as far as the shell reaches. Internal.
#pragma once

#include <optional>

#include "runtime/contacts/step_pair.h"

namespace vps::detail {

/// Of the box around a map's mesh. [m]
[[nodiscard]] float longest_side(const VoxelmapView& map) noexcept;

/// The outward normal of a plane, or of the face of a box that is wider than the shell. Field's frame. Else nothing.
std::optional<Vec3> wide_face(const StepPair& pair, const Partner& partner);

/// The same of a voxelmap around the shell, of which no part rises above the others by more than a voxel.
/// @param distance  that the shell may move, and up to which its points are sought. [m]
/// @param cache     keeps the bound of the region
std::optional<Vec3> even_face(const StepPair& pair, const Partner& partner, float distance, ContactCache& cache);

/// The plane that takes the place of a voxelmap near a shell: its surface is flat below it, and nothing else is nearer.
/// V above it differs by a twentieth of a voxel at most, and by the field's error. Null: there is none, or it is not
/// proven.
/// @param distance  as above
const HalfSpaceField* flat_ground(const StepPair& pair, const Partner& partner, float distance, GroundMemory& memory);
/// The same around a ball.
/// @param centre, reach  its centre and radius, map's frame. [m]
/// @param has_ends       also near the end of a face, where the plane is proven anew after each voxel of motion
const HalfSpaceField* flat_around(const VoxelmapView& map, Vec3 centre, float reach, bool has_ends,
                                  GroundMemory& memory);
/// The plane over a voxelmap around a ball: nothing of it is above, but it may have slots and holes. Null: there is
/// none, or it is not proven.
const HalfSpaceField* tops_around(const VoxelmapView& map, Vec3 centre, float reach, GroundMemory& memory);
/// Whether the map has a surface below a place, within 0.1 voxels of the plane over its tops.
bool has_ground(const VoxelmapView& map, const HalfSpaceField& tops, Vec3 place) noexcept;
/// Whether a body stands on the plane over a map's tops, by what is below its places there. In a hole or on an edge it
/// meets the map.
class Footing {
 public:
  /// @param map, tops  must live as long as this
  Footing(const StepPair& pair, const VoxelmapView& map, const HalfSpaceField& tops) noexcept;
  /// Looks below a place of the body. Map's frame.
  /// @param lowest  the body's surface below it
  /// @return whether there is ground
  bool test(Vec3 place, Vec3 lowest) noexcept;
  /// No place touches lower ground, and half of them have ground.
  [[nodiscard]] bool holds() const noexcept { return !touches_lower_ && 2 * grounded_ >= tested_; }

 private:
  const VoxelmapView& map_;
  const HalfSpaceField& tops_;
  float lower_within_;
  std::size_t tested_ = 0, grounded_ = 0;
  bool touches_lower_ = false;
};

/// Whether a body moves along a face of another that does not turn, or spins on it: however fast, its points come no
/// closer to the face.
/// @param normal      of the face, world
/// @param voxel_size  of the finer body. [m]
bool moves_along(const StepMotion& body, const StepMotion& ground, Vec3 normal, double voxel_size) noexcept;

}  // namespace vps::detail

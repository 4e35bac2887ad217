// SPDX-License-Identifier: Zlib
/// @file Which of two baked bodies gives the pointshell in Bullet and in planned scenes. Internal. Paper: Sec. 3.2.
#pragma once

#include <cstdint>

namespace vps {

struct ShellSide {
  double voxel_size = 0;     ///< [m]
  std::uint64_t points = 0;  ///< of the pointshell
};

/// Whether the first of two bodies that both can gives the pointshell. The paper takes the body with fewer points.
/// Contacts between samples need samples where the other body is round: finer voxels decide where they differ by a
/// quarter.
inline bool gives_pointshell(const ShellSide& first, const ShellSide& second) noexcept {
  constexpr double kFiner = 1.25;
  if (first.voxel_size * kFiner < second.voxel_size) return true;
  if (second.voxel_size * kFiner < first.voxel_size) return false;
  return first.points <= second.points;
}

}  // namespace vps

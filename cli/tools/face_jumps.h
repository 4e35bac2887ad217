// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Jumps of a sampled field between its bricks: docs/internals/bounds.md, "Faces between bricks".
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "runtime/vps_runtime.h"

namespace vps::cli {

struct FaceJump {
  double largest = 0;             ///< [m]
  std::array<double, 3> place{};  ///< asset frame. [m]
};

/// The largest difference of V between two field bricks on their common face, in the band that the certificate covers.
/// All faces are measured: on a face the difference is bilinear between the finer brick's samples, so it is largest at
/// one of them.
/// @param map         of Field::scaled or Field::real
/// @param voxel_size  from AssetInfo: the view's is a float. [m]
[[nodiscard]] FaceJump largest_face_jump(const VoxelmapView& map, double voxel_size);

/// Of each of the asset's sampled fields.
[[nodiscard]] std::vector<std::pair<Field, FaceJump>> face_jumps(const Asset& asset);

}  // namespace vps::cli

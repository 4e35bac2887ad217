// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The assets that the benchmarks of queries ask, baked anew by every run.
#pragma once

#include <array>
#include <filesystem>

#include "cli/lab/assets.h"

namespace vps::bench {

inline constexpr double kVoxelSize = 0.0005;  // [m]

/// Both parts. @param options  their voxel size is taken to be `kVoxelSize`
[[nodiscard]] lab::BakedFile bake_body(const TriangleMesh& mesh, bake::BakeOptions options,
                                       const std::filesystem::path& path);

/// A box round the origin that only plays the voxelmap.
[[nodiscard]] lab::BakedFile bake_box(const std::array<double, 3>& half_extents, const std::filesystem::path& path);

}  // namespace vps::bench

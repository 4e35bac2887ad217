// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The assets of the query benchmarks, baked again in every run.
#pragma once

#include <array>
#include <filesystem>

#include "cli/lab/assets.h"

namespace vps::bench {

inline constexpr double kVoxelSize = 0.0005;  // [m]

/// Bakes voxelmap and pointshell. @param options  the voxel size is replaced by `kVoxelSize`
[[nodiscard]] lab::BakedFile bake_body(const TriangleMesh& mesh, bake::BakeOptions options,
                                       const std::filesystem::path& path);

/// A box centred at the origin, with a voxelmap only.
[[nodiscard]] lab::BakedFile bake_box(const std::array<double, 3>& half_extents, const std::filesystem::path& path);

}  // namespace vps::bench

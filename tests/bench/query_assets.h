// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The assets that the query benchmark asks, baked anew by every run.
#pragma once

#include <filesystem>
#include <memory>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::bench {

inline constexpr double kVoxelSize = 0.0005;  // [m]

struct BakedFile {
  std::filesystem::path path;
  std::shared_ptr<const Asset> asset;
};

/// Both parts. @param alpha  spacing of the pointshell over the voxel size
[[nodiscard]] BakedFile bake_body(const TriangleMesh& mesh, double alpha, const std::filesystem::path& path);

/// A box round the origin that only plays the voxelmap.
[[nodiscard]] BakedFile bake_box(const std::array<double, 3>& half_extents, const std::filesystem::path& path);

}  // namespace vps::bench

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The assets that the benchmarks of queries ask, baked anew by every run.
#pragma once

#include <filesystem>
#include <memory>

#include "bake/vps_bake.h"
#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::bench {

inline constexpr double kVoxelSize = 0.0005;  // [m]

struct BakedFile {
  std::filesystem::path path;
  std::shared_ptr<const Asset> asset;
};

/// Bakes, writes and opens again.
/// @throw BakeError, std::runtime_error
[[nodiscard]] BakedFile bake_file(const TriangleMesh& mesh, const BakeOptions& options,
                                  const std::filesystem::path& path);

/// Both parts. @param options  their voxel size is taken to be `kVoxelSize`
[[nodiscard]] BakedFile bake_body(const TriangleMesh& mesh, BakeOptions options, const std::filesystem::path& path);

/// A box round the origin that only plays the voxelmap.
[[nodiscard]] BakedFile bake_box(const std::array<double, 3>& half_extents, const std::filesystem::path& path);

/// The mesh with its origin at the asset's centre of mass, where all peers have it.
[[nodiscard]] TriangleMesh centred(TriangleMesh mesh, const Asset& asset);

}  // namespace vps::bench

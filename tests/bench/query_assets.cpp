// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/query_assets.h"

#include "sample_meshes/shapes.h"

namespace vps::bench {

lab::BakedFile bake_body(const TriangleMesh& mesh, bake::BakeOptions options, const std::filesystem::path& path) {
  options.voxel_size = kVoxelSize;
  return lab::bake_file(mesh, options, path);
}

lab::BakedFile bake_box(const std::array<double, 3>& half_extents, const std::filesystem::path& path) {
  bake::BakeOptions options;
  options.voxel_size = kVoxelSize;
  options.pointshell = false;
  return lab::bake_file(samples::make_box(half_extents), options, path);
}

}  // namespace vps::bench

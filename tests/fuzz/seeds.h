// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Small valid assets to mutate.
#pragma once

#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "sample_meshes/shapes.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

struct Seed {
  std::string name;
  TriangleMesh mesh;
  bake::BakeOptions options;
};

/// The layers alone, the scaled field alone and all fields together, each part alone, 8 and 16 bits, bricks of several
/// levels.
inline std::vector<Seed> seeds() {
  std::vector<Seed> out;
  const auto add = [&](const char* name, const TriangleMesh& mesh, double voxel_size) -> bake::BakeOptions& {
    bake::BakeOptions options;
    options.voxel_size = voxel_size;
    out.push_back({name, mesh, options});
    return out.back().options;
  };
  const TriangleMesh box = samples::make_box({0.1, 0.1, 0.1});
  const TriangleMesh torus = samples::make_torus(0.1, 0.04, 24, 12);
  add("box", box, 0.02);
  bake::BakeOptions& all = add("torus_all_fields", torus, 0.012);
  all.layers = all.real = true;
  bake::BakeOptions& layers = add("layers", torus, 0.02);
  layers.layers = true;
  layers.scaled = false;
  add("sixteen_bits", torus, 0.02).precision = 5;
  add("voxelmap", box, 0.02).pointshell = false;
  add("pointshell", torus, 0.02).voxelmap = false;
  add("binary_tree", box, 0.02).branching = 2;
  add("thin_faces", samples::make_box({0.1, 0.08, 0.06}), 0.004).thin_faces = 4;  // flat nodes too
  return out;
}

/// Bakes and writes a seed.
inline void write_seed(const Seed& seed, const std::filesystem::path& path) {
  const bake::BakedAsset asset = bake::bake(seed.mesh, seed.options);
  write_asset(path, asset.info, asset.sections);
}

}  // namespace vps::test

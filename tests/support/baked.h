// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes a mesh, writes it, and maps it again: an asset as a simulation sees it.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "bake/vps_bake.h"
#include "runtime/vps_runtime.h"
#include "tests/support/temporary_folder.h"

namespace vps::test {

inline bake::BakeOptions all_fields(double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  options.layers = options.scaled = options.real = true;
  return options;
}

inline std::shared_ptr<Asset> baked(const TriangleMesh& mesh, const bake::BakeOptions& options) {
  const TemporaryFolder folder;
  const bake::BakedAsset result = bake::bake(mesh, options);
  write_asset(folder / "asset.vps.hdf", result.info, result.sections);
  auto asset = std::make_shared<Asset>();
  EXPECT_EQ(Asset::open((folder / "asset.vps.hdf").c_str(), *asset), Status::ok);
  return asset;  // the mapping outlives the file's name
}

}  // namespace vps::test

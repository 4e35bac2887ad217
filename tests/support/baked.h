// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes a mesh and opens the asset in memory.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bake/store/cache.h"
#include "bake/vps_bake.h"
#include "runtime/vps_runtime.h"

namespace vps::test {

inline bake::BakeOptions all_fields(double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  options.layers = options.scaled = options.real = true;
  return options;
}

/// Bakes each mesh with each setting once in a process: most tests of a program look at the same few assets.
inline std::shared_ptr<Asset> baked(const TriangleMesh& mesh, const bake::BakeOptions& options) {
  struct Held {
    std::vector<std::byte> bytes;
    Asset asset;
  };
  static std::map<std::string, std::shared_ptr<Held>> known;
  bake::BakeSettings settings;
  settings.options = options;
  std::shared_ptr<Held>& held = known[bake::bake_record(mesh, settings).text];
  if (held == nullptr) {
    const bake::BakedAsset result = bake::bake(mesh, options);
    held = std::make_shared<Held>();
    held->bytes = asset_bytes(result.info, result.sections);
    EXPECT_EQ(Asset::open(held->bytes, held->asset), Status::ok);
  }
  return {held, &held->asset};
}

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes assets to measure, without a cache.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "bake/store/cache.h"
#include "bake/vps_bake.h"
#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

/// Makes the record that a bake with these options stores in its asset. With it a measured asset has the size of a
/// user's.
using RecordOf = std::function<bake::BakeRecord(const bake::BakeOptions&)>;

struct BakedFile {
  std::filesystem::path path;
  std::shared_ptr<const Asset> asset;
};

/// Bakes an asset, writes it to `path` and opens that file.
/// @throw BakeError, std::runtime_error
[[nodiscard]] BakedFile bake_file(const TriangleMesh& mesh, const bake::BakeOptions& options,
                                  const std::filesystem::path& path);

/// Bakes an asset and opens it in memory, without a file.
/// @param record  may be empty: then the asset has no record
/// @throw BakeError, WriteError
[[nodiscard]] std::shared_ptr<const Asset> bake_in_memory(const TriangleMesh& mesh, const bake::BakeOptions& options,
                                                          const RecordOf& record = {});

/// Moves the mesh so that its origin is the asset's centre of mass, as all compared libraries need it.
[[nodiscard]] TriangleMesh centred(TriangleMesh mesh, const Asset& asset);

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Assets to measure, baked anew.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "bake/store/cache.h"
#include "bake/vps_bake.h"
#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

/// The record that a bake with these options puts into its asset, so that what is measured is as large.
using RecordOf = std::function<bake::BakeRecord(const bake::BakeOptions&)>;

struct BakedFile {
  std::filesystem::path path;
  std::shared_ptr<const Asset> asset;
};

/// Bakes, writes and opens again.
/// @throw BakeError, std::runtime_error
[[nodiscard]] BakedFile bake_file(const TriangleMesh& mesh, const bake::BakeOptions& options,
                                  const std::filesystem::path& path);

/// Bakes and opens without a file.
/// @param record  may be empty: the asset has none
/// @throw BakeError, WriteError
[[nodiscard]] std::shared_ptr<const Asset> bake_in_memory(const TriangleMesh& mesh, const bake::BakeOptions& options,
                                                          const RecordOf& record = {});

/// The mesh with its origin at the asset's centre of mass, where all peers have it.
[[nodiscard]] TriangleMesh centred(TriangleMesh mesh, const Asset& asset);

}  // namespace vps::lab

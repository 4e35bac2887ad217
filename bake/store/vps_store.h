// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Gives programs the asset of a mesh: from a cache, which `vpsbake --cache` can share, or freshly baked. Every
/// path from a mesh to an asset goes through `bake_stored`: hash, look into the cache, import, bake, store.
/// Paper: Sec. 5, the data structures made within the physics engine, given a mesh.
///
///     vps::bake::BakeSettings settings;
///     settings.options.voxel_size = 0.5e-3;
///     const auto gear = vps::bake::load_or_bake("gear.obj", settings, cache_folder).asset;
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bake/store/cache.h"

namespace vps::bake {

/// An asset from the cache or fresh from the baker, with its record.
struct StoredAsset {
  std::shared_ptr<const Asset> asset;  ///< never null, open; needs no file any more
  bool baked = false;                  ///< false: from the cache
  std::optional<CacheKey> key;  ///< nothing when a file of the mesh cannot be read: then the cache does not hold it
  BakeReport report;
  std::vector<StageTime> times;  ///< cache, import, those of bake, encode, store: the stages that were run. [s]
  std::string warning;           ///< why the cache does not hold the asset now; empty: it does, or none was given
};

/// The asset of a mesh file. When the file changes while it is read, it is read again; three readings at most.
/// `settings.options.progress` is called for the stages import, search and store, too.
/// @param cache      null: none is used
/// @param on_import  called after the mesh was read, unless the cache has the asset. What it throws ends the bake
/// @throw ImportError also when the file keeps changing
/// @throw BakeError
[[nodiscard]] StoredAsset bake_stored(const std::filesystem::path& mesh, const BakeSettings& settings,
                                      const AssetCache* cache, const std::function<void()>& on_import = {});

/// The same for a mesh in memory, in metres; identical positions are joined. `settings.import` is not used.
/// @throw BakeError
[[nodiscard]] StoredAsset bake_stored(const TriangleMesh& mesh, const BakeSettings& settings, const AssetCache* cache);

/// The plan of a bake with these settings: searches the voxel size when `settings.max_error` is set.
/// @throw BakeError
[[nodiscard]] BakePlan plan_bake(const TriangleMesh& mesh, const BakeSettings& settings);

/// The bytes of a whole asset, opened; the pointer owns them.
/// @throw WriteError when they are no asset
[[nodiscard]] std::shared_ptr<const Asset> open_in_memory(std::vector<std::byte> bytes);

/// A failure with its file and its stage: import, one of bake's, or write. `what()` is "reason; what to do".
struct LoadError : BakeError {
  std::string file;  ///< empty for a mesh in memory
  LoadError(std::string stage_in, std::string file_in, const std::string& message)
      : BakeError(std::move(stage_in), message), file(std::move(file_in)) {}
};

/// `bake_stored` with one kind of error. Threads may call it at the same time.
/// @param cache_folder  made when missing; empty: no cache. One that cannot be used costs a warning, not the asset
/// @throw LoadError
[[nodiscard]] StoredAsset load_or_bake(const std::filesystem::path& mesh, const BakeSettings& settings,
                                       const std::filesystem::path& cache_folder = {});

/// The same for a mesh in memory, in metres; identical positions are joined. `settings.import` is not used.
[[nodiscard]] StoredAsset load_or_bake(const TriangleMesh& mesh, const BakeSettings& settings,
                                       const std::filesystem::path& cache_folder = {});

}  // namespace vps::bake

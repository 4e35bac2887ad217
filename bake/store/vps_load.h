// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Assets for programs that have meshes: baked while loading, or taken from a cache, the same as that of
/// `vpsbake --cache`. Paper: Sec. 5, the data structures made within the physics engine, given a mesh.
///
///     vps::bake::BakeSettings settings;
///     settings.options.voxel_size = 0.5e-3;
///     const auto gear = vps::bake::load_or_bake("gear.obj", settings, cache_folder).asset;
#pragma once

#include <memory>
#include <string>

#include "bake/store/cache.h"

namespace vps::bake {

struct LoadedAsset {
  std::shared_ptr<const Asset> asset;  ///< never null, open; needs no file any more
  bool baked = false;                  ///< false: from the cache
  BakeReport report;
  std::string warning;  ///< why the cache does not hold the asset now; empty: it does, or none was asked for
};

/// What went wrong with which file, at which stage: import, one of bake's, or write. `what()` is "reason; what to do".
struct LoadError : BakeError {
  std::string file;  ///< empty for a mesh in memory
  LoadError(std::string stage_in, std::string file_in, const std::string& message)
      : BakeError(std::move(stage_in), message), file(std::move(file_in)) {}
};

/// The asset of a mesh file, baked unless the cache has it. Threads may call it at the same time.
/// @param cache_folder  made when missing; empty: no cache. One that cannot be used costs a warning, not the asset
/// @throw LoadError
[[nodiscard]] LoadedAsset load_or_bake(const std::filesystem::path& mesh, const BakeSettings& settings,
                                       const std::filesystem::path& cache_folder = {});

/// The same for a mesh in memory, in metres; identical positions are joined. `settings.import` is not used.
[[nodiscard]] LoadedAsset load_or_bake(const TriangleMesh& mesh, const BakeSettings& settings,
                                       const std::filesystem::path& cache_folder = {});

}  // namespace vps::bake

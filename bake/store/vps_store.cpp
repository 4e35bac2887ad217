// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/store/vps_store.h"

#include <chrono>
#include <exception>

namespace vps::bake {
namespace {

namespace fs = std::filesystem;

void show_stage(const BakeSettings& settings, const char* stage, double fraction) {
  if (settings.options.progress) settings.options.progress(stage, fraction);
}

// Records the time of a stage that is not one of bake's.
template <class Work>
auto timed(std::vector<StageTime>& times, const char* stage, const Work& work) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  auto result = work();
  times.push_back({stage, std::chrono::duration<double>(Clock::now() - begin).count()});
  return result;
}

// The options of one bake. Searches the voxel size if the settings ask for that.
BakeOptions options_for(const TriangleMesh& mesh, const BakeSettings& settings) {
  BakeOptions options = settings.options;
  if (settings.max_error > 0) {
    show_stage(settings, "search", 0);
    options.voxel_size = find_voxel_size(mesh, options, settings.max_error);
  }
  return options;
}

// Reads the mesh again when it was written meanwhile. It is then unknown which bytes were imported, and they may be the
// reason why the import failed.
ImportedMesh import_steady(const fs::path& file, const BakeSettings& settings, MeshState& state) {
  constexpr int kAttempts = 3;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    ImportedMesh mesh;
    std::exception_ptr failure;
    try {
      mesh = import_mesh(file, settings.import);
    } catch (const ImportError&) {
      failure = std::current_exception();
    }
    MeshState after = mesh_state(file, settings);
    if (after == state && failure) std::rethrow_exception(failure);
    if (after == state) return mesh;
    state = std::move(after);
  }
  throw ImportError(ImportError::Kind::io, "the mesh changes while it is read; bake again when it is complete");
}

// The path from a mesh to an asset. Files and meshes in memory differ only in the record and the import.
struct Pipeline {
  const BakeSettings& settings;
  const AssetCache* cache;
  std::optional<BakeRecord> record = {};
  StoredAsset result = {};

  // @param find_record  hashes the mesh; @return whether the cache has the asset
  template <class FindRecord>
  bool look_up(const FindRecord& find_record) {
    const auto find = [&] {
      record = find_record();
      return cache != nullptr && record && open_cached(cache_key(*record));
    };
    return cache != nullptr ? timed(result.times, "cache", find) : find();
  }

  BakedAsset bake_mesh(const TriangleMesh& mesh) {
    BakeOptions options = options_for(mesh, settings);
    options.planned = [&](const BakePlan& plan) {
      result.report.plan = plan;
      if (settings.options.planned) settings.options.planned(plan);
    };
    BakedAsset baked = bake(mesh, options);
    result.times.insert(result.times.end(), baked.times.begin(), baked.times.end());
    result.report.repair = baked.repair;
    result.report.filled_share = baked.filled_share;
    result.report.notes.insert(result.report.notes.end(), baked.notes.begin(), baked.notes.end());
    if (record) add_record(*record, baked);
    return baked;
  }

  // @return whether the cache has the asset now, open in `result`
  bool store(std::span<const std::byte> asset) {
    if (cache == nullptr) return false;
    show_stage(settings, "store", 1);
    const auto add = [&] { return cache->store(result.key, asset, result.report); };
    result.warning = timed(result.times, "store", add);
    return result.warning.empty() && open_cached(*result.key);
  }

  // @param mesh  as read, with what the import noted
  StoredAsset finish(const TriangleMesh& mesh, std::vector<std::string> notes) {
    if (record) result.key = cache_key(*record);
    result.baked = true;
    result.report.notes = std::move(notes);
    std::vector<std::byte> bytes = encode(bake_mesh(mesh));
    if (!store(bytes)) result.asset = open_in_memory(std::move(bytes));
    return std::move(result);
  }

  StoredAsset finish_hit() {
    result.key = cache_key(*record);
    return std::move(result);
  }

 private:
  bool open_cached(const CacheKey& key) {
    const auto asset = std::make_shared<Asset>();
    if (!cache->open(key, *asset, result.report)) return false;
    result.asset = asset;
    return true;
  }

  std::vector<std::byte> encode(const BakedAsset& baked) {
    return timed(result.times, "encode", [&] { return asset_bytes(baked.info, baked.sections); });
  }
};

StoredAsset load_named(const std::string& file, const fs::path& cache_folder,
                       const std::function<StoredAsset(const AssetCache*)>& find) {
  const AssetCache folder(cache_folder);
  const AssetCache* const cache = cache_folder.empty() ? nullptr : &folder;
  try {
    return find(cache);
  } catch (const ImportError& error) {
    throw LoadError("import", file, error.what());
  } catch (const BakeError& error) {
    throw LoadError(error.stage, file, error.what());
  } catch (const WriteError& error) {
    throw LoadError("write", file, error.what());
  }
}

}  // namespace

std::shared_ptr<const Asset> open_in_memory(std::vector<std::byte> bytes) {
  struct Held {
    std::vector<std::byte> bytes;
    Asset asset;
  };
  const auto held = std::make_shared<Held>();
  held->bytes = std::move(bytes);
  if (const Status status = Asset::open(held->bytes, held->asset); status != Status::ok) {
    throw WriteError(std::string(describe(status)) + "; this is a defect, please report it");
  }
  return {held, &held->asset};
}

StoredAsset bake_stored(const fs::path& mesh, const BakeSettings& settings, const AssetCache* cache,
                        const std::function<void()>& on_import) {
  Pipeline pipeline{settings, cache};
  MeshState state;
  const auto find_record = [&] {
    state = mesh_state(mesh, settings);
    return state.record;
  };
  if (pipeline.look_up(find_record)) return pipeline.finish_hit();
  show_stage(settings, "import", 0);
  const auto read = [&] { return import_steady(mesh, settings, state); };
  ImportedMesh imported = timed(pipeline.result.times, "import", read);
  pipeline.record = state.record;  // of the last reading
  if (on_import) on_import();
  return pipeline.finish(imported, std::move(imported.notes));
}

StoredAsset bake_stored(const TriangleMesh& mesh, const BakeSettings& settings, const AssetCache* cache) {
  Pipeline pipeline{settings, cache};
  if (pipeline.look_up([&] { return std::optional(bake_record(mesh, settings)); })) return pipeline.finish_hit();
  return pipeline.finish(mesh, {});
}

BakePlan plan_bake(const TriangleMesh& mesh, const BakeSettings& settings) {
  return plan_bake(mesh, options_for(mesh, settings));
}

StoredAsset load_or_bake(const fs::path& mesh, const BakeSettings& settings, const fs::path& cache_folder) {
  return load_named(mesh.string(), cache_folder,
                    [&](const AssetCache* cache) { return bake_stored(mesh, settings, cache); });
}

StoredAsset load_or_bake(const TriangleMesh& mesh, const BakeSettings& settings, const fs::path& cache_folder) {
  return load_named({}, cache_folder, [&](const AssetCache* cache) { return bake_stored(mesh, settings, cache); });
}

}  // namespace vps::bake

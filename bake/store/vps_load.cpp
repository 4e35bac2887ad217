// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/store/vps_load.h"

#include <cstdlib>
#include <functional>
#include <system_error>

namespace vps::bake {
namespace {

namespace fs = std::filesystem;

// A folder that goes away with it, for assets that no cache keeps.
class PassingFolder {
 public:
  PassingFolder() {
    std::error_code failed;
    std::string name = (fs::temp_directory_path(failed) / "vps.XXXXXX").string();
    if (failed || ::mkdtemp(name.data()) == nullptr)
      throw WriteError("there is no room for a temporary file; set TMPDIR to another folder");
    path_ = name;
  }
  PassingFolder(const PassingFolder&) = delete;
  PassingFolder& operator=(const PassingFolder&) = delete;
  ~PassingFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// The mapping outlives the file's name.
void map_without_name(const BakedAsset& baked, Asset& asset) {
  const PassingFolder folder;
  const fs::path file = folder.path() / "asset.vps.hdf";
  write_asset(file, baked.info, baked.sections);
  if (const Status status = Asset::open(file.c_str(), asset); status != Status::ok) {
    throw WriteError(std::string(describe(status)) + "; this is a defect, please report it");
  }
}

BakedAsset bake_as_set(const TriangleMesh& mesh, const BakeSettings& settings, BakeReport& report) {
  BakeOptions options = settings.options;
  if (settings.max_error > 0) options.voxel_size = find_voxel_size(mesh, options, settings.max_error);
  report.plan = plan_bake(mesh, options);
  BakedAsset baked = bake(mesh, options);
  report.repair = baked.repair;
  report.filled_share = baked.filled_share;
  report.notes.insert(report.notes.end(), baked.notes.begin(), baked.notes.end());
  return baked;
}

// Bakes; empties the record when it is not certain that it is what was baked.
using Baker = std::function<BakedAsset(BakeReport&, std::optional<BakeRecord>&)>;

LoadedAsset load(const fs::path& cache_folder, std::optional<BakeRecord> record, const Baker& baker) {
  const AssetCache cache(cache_folder);
  LoadedAsset loaded;
  const auto asset = std::make_shared<Asset>();
  loaded.asset = asset;
  const bool with_cache = !cache_folder.empty();
  if (with_cache && record && cache.open(cache_key(*record), *asset, loaded.report)) return loaded;
  loaded.baked = true;
  BakedAsset baked = baker(loaded.report, record);
  if (record) add_record(*record, baked);
  if (with_cache) {
    const auto key = record ? std::optional(cache_key(*record)) : std::nullopt;
    loaded.warning = cache.store(key, baked, loaded.report);
    if (loaded.warning.empty() && cache.open(*key, *asset, loaded.report)) return loaded;
  }
  map_without_name(baked, *asset);
  return loaded;
}

LoadedAsset guarded(const std::string& file, const std::function<LoadedAsset()>& work) {
  try {
    return work();
  } catch (const ImportError& error) {
    throw LoadError("import", file, error.what());
  } catch (const BakeError& error) {
    throw LoadError(error.stage, file, error.what());
  } catch (const WriteError& error) {
    throw LoadError("write", file, error.what());
  }
}

}  // namespace

LoadedAsset load_or_bake(const fs::path& mesh, const BakeSettings& settings, const fs::path& cache_folder) {
  return guarded(mesh.string(), [&] {
    const MeshState state = mesh_state(mesh, settings);
    return load(cache_folder, state.record, [&](BakeReport& report, std::optional<BakeRecord>& record) {
      const ImportedMesh imported = import_mesh(mesh, settings.import);
      // Edited meanwhile: nobody knows which bytes were imported.
      if (state != mesh_state(mesh, settings)) record.reset();
      report.notes = imported.notes;
      return bake_as_set(imported, settings, report);
    });
  });
}

LoadedAsset load_or_bake(const TriangleMesh& mesh, const BakeSettings& settings, const fs::path& cache_folder) {
  return guarded({}, [&] {
    return load(cache_folder, bake_record(mesh, settings),
                [&](BakeReport& report, auto&) { return bake_as_set(mesh, settings, report); });
  });
}

}  // namespace vps::bake

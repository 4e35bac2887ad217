// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/bake_scene.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "bake/quantity_text.h"
#include "bake/store/vps_store.h"
#include "cli/scene/former_assets.h"
#include "cli/scene/write_manifest.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/output_file.h"
#include "formats/scene_manifest.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

// Why the folder cannot be written, as far as a check beforehand shows; empty when it can.
std::string folder_refusal(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored)) return "this is a file; name a folder with -o";
  const fs::path parent = fs::absolute(folder, ignored).lexically_normal().parent_path();
  const fs::path& first = fs::exists(folder, ignored) ? folder : parent;
  if (!fs::is_directory(first, ignored)) return "the folder above does not exist; create it or choose another with -o";
  if (::access(first.c_str(), W_OK) != 0) return "the folder may not be written; choose another with -o";
  return "";
}

fs::path manifest_file(const SceneRun& run) {
  return run.options.folder / (run.options.scene.stem().string() + ".vps.json");
}

bool is_written(const SceneRun& run, const PlannedAsset& asset) {
  return run.options.full || asset.is_needed();
}

const bake::BakeOptions& wanted_options(const SceneRun& run, const PlannedAsset& asset) {
  return run.options.full ? asset.everything : asset.options;
}

// Predicted, of the bake of what is written.
double seconds_of(const SceneRun& run, const PlannedAsset& asset) {
  if (!is_written(run, asset)) return 0;
  return run.options.full ? asset.seconds_everything : asset.seconds;
}

void name_asset(SceneRun& run, PlannedAsset& asset) {
  asset.file = asset_file(run.meshes[asset.mesh], wanted_options(run, asset));
}

[[noreturn]] void refuse_mesh(const SceneRun& run, const PlannedAsset& asset, const char* reason) {
  throw SceneError(asset.place, fmt::format("mesh '{}': {}", run.meshes[asset.mesh].file.string(), reason));
}

void report_progress(const SceneRun& run, const PlannedAsset& asset, const char* stage, double seconds) {
  if (!run.options.progress) return;
  const double fraction = run.seconds > 0 ? (run.seconds_done + seconds) / run.seconds : 0;
  run.options.progress(run.meshes[asset.mesh].file, stage, fraction);
}

// @param seconds  predicted
BakedPart bake_part(const SceneRun& run, const PlannedAsset& asset, const bake::BakeOptions& options, double seconds,
                    const std::string& cache) {
  const auto begin = std::chrono::steady_clock::now();
  bake::BakeSettings settings;
  settings.options = options;
  settings.options.progress = [&](const char* stage, double fraction) {
    report_progress(run, asset, stage, fraction * seconds);
  };
  try {
    bake::StoredAsset loaded = bake::load_or_bake(run.meshes[asset.mesh].mesh, settings, cache);
    if (!loaded.warning.empty() && run.options.warn) run.options.warn(loaded.warning);
    const double measured = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return {std::move(loaded.asset), loaded.baked ? measured : 0, !loaded.baked, std::move(loaded.report.notes)};
  } catch (const bake::LoadError& error) {
    if (error.stage == "write") throw WriteError(error.what());
    refuse_mesh(run, asset, error.what());
  }
}

// Factor by which an asset must be finer to keep the wished error; 1 when it is fine enough.
double lacking(const PlannedAsset& asset, const AssetInfo& info, double error) {
  double worst = 1;
  if (asset.options.voxelmap) worst = std::max(worst, info.scaled_error.bound / (kFieldShare * error));
  if (asset.options.pointshell) worst = std::max(worst, info.covering_radius / ((1 - kFieldShare) * error));
  return worst;
}

void bake_asset(SceneRun& run, std::size_t i) {
  PlannedAsset& asset = run.plan.assets[i];
  if (!is_written(run, asset)) return;
  constexpr int kTrials = 5;
  for (int trial = 1;; ++trial) {
    run.baked[i] = bake_part(run, asset, wanted_options(run, asset), seconds_of(run, asset), run.options.cache);
    if (run.scene.error.value == 0) return;
    const double by = lacking(asset, run.baked[i].asset->info(), run.scene.error.value);
    if (by <= 1) return;
    if (trial == kTrials) {
      throw SceneError(run.scene.error.place,
                       fmt::format("'{}' does not reach the wished error with voxels of {}; wish "
                                   "a larger one",
                                   asset.file, bake::format_length(asset.options.voxel_size)));
    }
    refine(asset, 1.03 * by);
    name_asset(run, asset);
  }
}

}  // namespace

void plan_run(SceneRun& run) {
  run.scene = read_scene(run.options.scene);
  if (!run.options.dry_run) {  // before the meshes, which take longer
    const std::string folder = run.options.folder.string();
    if (const std::string reason = folder_refusal(folder); !reason.empty())
      throw SceneError({folder, 0}, reason, SceneError::Kind::io);
  }
  run.meshes = read_meshes(run.scene);
  doubt_units(run.scene, run.meshes);
  run.plan = plan_scene(run.scene, run.meshes);
  run.baked.resize(run.plan.assets.size());
  for (PlannedAsset& asset : run.plan.assets) name_asset(run, asset);
}

// Files with these names may exist if this program wrote them.
std::optional<RefusedFile> refused_output(const SceneRun& run) {
  const fs::path& folder = run.options.folder;
  if (const std::string reason = folder_refusal(folder); !reason.empty()) return RefusedFile{folder, reason};
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return std::nullopt;
  for (const PlannedAsset& asset : run.plan.assets) {
    if (!is_written(run, asset)) continue;
    const fs::path file = folder / asset.file;
    if (const std::string reason = asset_refusal(file); !reason.empty()) return RefusedFile{file, reason};
  }
  const fs::path manifest = manifest_file(run);
  const std::string reason = output_refusal(manifest, kManifestBeginning, "a scene's manifest");
  if (!reason.empty()) return RefusedFile{manifest, reason};
  return std::nullopt;
}

// Skips assets in the cache, which were baked before, and the first asset to bake, whose bake begins with this check.
void check_meshes(const SceneRun& run) {
  bool is_first = !run.options.dry_run;
  for (const PlannedAsset& asset : run.plan.assets) {
    if (!is_written(run, asset) && !run.options.compare) continue;
    const TriangleMesh& mesh = run.meshes[asset.mesh].mesh;
    bake::BakeSettings settings;
    // One that nobody needs is baked for the comparison alone: its plan has no parts.
    settings.options = is_written(run, asset) ? wanted_options(run, asset) : asset.ordinary;
    Asset cached;
    bake::BakeReport ignored;
    const std::string& cache = run.options.cache;
    if (!cache.empty() &&
        bake::AssetCache(cache).open(bake::cache_key(bake::bake_record(mesh, settings)), cached, ignored))
      continue;
    if (is_written(run, asset) && std::exchange(is_first, false)) continue;
    report_progress(run, asset, "check", 0);
    try {
      (void)bake::closed_mesh(mesh, settings.options);
    } catch (const bake::BakeError& error) {
      refuse_mesh(run, asset, error.what());
    }
  }
}

void bake_scene(SceneRun& run) {
  run.baked.resize(run.plan.assets.size());
  for (const PlannedAsset& asset : run.plan.assets) {
    run.seconds += seconds_of(run, asset);
    if (run.options.compare) run.seconds += asset.seconds_ordinary + asset.seconds_everything;
  }
  for (std::size_t i = 0; i < run.plan.assets.size(); ++i) {
    const double seconds = seconds_of(run, run.plan.assets[i]);  // a finer bake may take longer
    bake_asset(run, i);
    run.seconds_done += seconds;
  }
  if (run.options.compare) {
    for (const PlannedAsset& asset : run.plan.assets) {
      run.ordinary.push_back(bake_part(run, asset, asset.ordinary, asset.seconds_ordinary, ""));
      run.seconds_done += asset.seconds_ordinary;
      run.everything.push_back(bake_part(run, asset, asset.everything, asset.seconds_everything, ""));
      run.seconds_done += asset.seconds_everything;
    }
  }
  double bytes = 0;
  for (const BakedPart& part : run.baked) bytes += part.asset ? static_cast<double>(part.asset->bytes().size()) : 0;
  if (!run.options.full && run.scene.memory.value > 0 && bytes > run.scene.memory.value) {
    const auto [needed, wished] = bake::differing_bytes(bytes, run.scene.memory.value);
    throw SceneError(
        run.scene.memory.place,
        fmt::format("the assets take {}, more than the {} wished; wish more memory or coarser voxels", needed, wished));
  }
}

std::string write_scene(SceneRun& run) {
  const fs::path& folder = run.options.folder;
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (failed) throw WriteError("the folder cannot be made; choose another with -o");
  for (std::size_t i = 0; i < run.plan.assets.size(); ++i) {
    if (run.baked[i].asset != nullptr) write_whole(folder / run.plan.assets[i].file, run.baked[i].asset->bytes());
  }
  const fs::path manifest = manifest_file(run);
  const std::string text = to_text(to_manifest(run.scene, run.meshes, run.plan, run.baked));
  if (text.size() > scene_manifest::kMostBytes)
    throw SceneError({run.options.scene.string(), 1}, "the manifest would be larger than 64 MiB; leave bodies out");
  const std::set<std::string> former = assets_of(manifest);
  write_whole(manifest, std::as_bytes(std::span(text)));
  run.removed = remove_unlisted(folder, former);
  return manifest.string();
}

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <span>
#include <utility>

#include "bake/quantity_text.h"
#include "bake/store/vps_store.h"
#include "cli/scene/former_assets.h"
#include "cli/scene/report_scene.h"
#include "cli/scene/write_manifest.h"
#include "cli/terminal/complain.h"
#include "cli/tools/describe_asset.h"
#include "cli/tools/output_file.h"
#include "formats/scene_manifest.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

struct SceneArguments {
  std::string scene;
  std::string output;  // folder; empty: NAME.vps beside the scene
  std::string cache;   // folder of an AssetCache; empty: none
  bool dry_run = false, full = false, compare = false, json = false;
};

struct SceneRun {
  const SceneArguments& arguments;
  Scene scene = {};
  std::vector<SceneMesh> meshes = {};
  ScenePlan plan = {};
  std::vector<BakedPart> baked = {}, ordinary = {}, everything = {};
  std::vector<std::string> removed = {};  // assets of an earlier plan
};

// Where the folder cannot be written, as far as that can be told beforehand; empty when it can.
std::string folder_refusal(const fs::path& folder) {
  std::error_code ignored;
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored)) return "this is a file; name a folder with -o";
  const fs::path parent = fs::absolute(folder, ignored).lexically_normal().parent_path();
  const fs::path& first = fs::exists(folder, ignored) ? folder : parent;
  if (!fs::is_directory(first, ignored)) return "the folder above does not exist; create it or choose another with -o";
  if (::access(first.c_str(), W_OK) != 0) return "the folder may not be written; choose another with -o";
  return "";
}

fs::path manifest_file(const SceneArguments& arguments, const fs::path& folder) {
  return folder / (fs::path(arguments.scene).stem().string() + ".vps.json");
}

bool is_written(const SceneRun& run, const PlannedAsset& asset) {
  return run.arguments.full || asset.is_needed();
}

const bake::BakeOptions& wanted_options(const SceneRun& run, const PlannedAsset& asset) {
  return run.arguments.full ? asset.everything : asset.options;
}

void name_asset(SceneRun& run, PlannedAsset& asset) {
  asset.file = asset_file(run.meshes[asset.mesh], wanted_options(run, asset));
}

// Whether the folder has files of these names that are not the program's. @return false when one was complained of
bool outputs_are_free(const SceneRun& run, const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder, ignored)) return true;
  const auto is_free = [](const fs::path& file, const std::string& reason) {
    if (!reason.empty()) (void)fail(kIo, file.string(), reason);
    return reason.empty();
  };
  for (const PlannedAsset& asset : run.plan.assets) {
    const fs::path file = folder / asset.file;
    if (is_written(run, asset) && !is_free(file, asset_refusal(file))) return false;
  }
  const fs::path manifest = manifest_file(run.arguments, folder);
  return is_free(manifest, output_refusal(manifest, kManifestBeginning, "a scene's manifest"));
}

fs::path output_folder(const SceneArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  fs::path folder = arguments.scene;
  return folder.replace_extension(".vps");
}

[[noreturn]] void refuse_mesh(const SceneRun& run, const PlannedAsset& asset, const char* reason) {
  throw SceneError(asset.place, fmt::format("mesh '{}': {}", run.meshes[asset.mesh].file.string(), reason));
}

BakedPart bake_part(const SceneRun& run, const PlannedAsset& asset, const bake::BakeOptions& options,
                    const std::string& cache) {
  const auto begin = std::chrono::steady_clock::now();
  bake::BakeSettings settings;
  settings.options = options;
  try {
    bake::LoadedAsset loaded = bake::load_or_bake(run.meshes[asset.mesh].mesh, settings, cache);
    if (!loaded.warning.empty()) complain("warning", cache, loaded.warning + "; the asset is not kept there");
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    return {std::move(loaded.asset), loaded.baked ? seconds : 0, !loaded.baked, std::move(loaded.report.notes)};
  } catch (const bake::LoadError& error) {
    if (error.stage == "write") throw WriteError(error.what());
    refuse_mesh(run, asset, error.what());
  }
}

// Meshes that cannot be baked are refused before anything is, also in a dry run. What a cache has is good, and the
// first bake begins with this check.
void check_meshes(const SceneRun& run) {
  bool is_first = !run.arguments.dry_run;
  for (const PlannedAsset& asset : run.plan.assets) {
    if (!is_written(run, asset) && !run.arguments.compare) continue;
    const TriangleMesh& mesh = run.meshes[asset.mesh].mesh;
    bake::BakeSettings settings;
    settings.options = wanted_options(run, asset);
    Asset cached;
    bake::BakeReport ignored;
    const std::string& cache = run.arguments.cache;
    if (!cache.empty() &&
        bake::AssetCache(cache).open(bake::cache_key(bake::bake_record(mesh, settings)), cached, ignored))
      continue;
    if (is_written(run, asset) && std::exchange(is_first, false)) continue;
    try {
      (void)bake::closed_mesh(mesh, settings.options);
    } catch (const bake::BakeError& error) {
      refuse_mesh(run, asset, error.what());
    }
  }
}

// How much finer an asset has to be for its share of the wished error; 1 when it is fine enough.
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
    run.baked[i] = bake_part(run, asset, wanted_options(run, asset), run.arguments.cache);
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

void bake_scene(SceneRun& run) {
  run.baked.resize(run.plan.assets.size());
  for (std::size_t i = 0; i < run.plan.assets.size(); ++i) bake_asset(run, i);
  if (run.arguments.compare) {
    for (const PlannedAsset& asset : run.plan.assets) {
      run.ordinary.push_back(bake_part(run, asset, asset.ordinary, ""));
      run.everything.push_back(bake_part(run, asset, asset.everything, ""));
    }
  }
  double bytes = 0;
  for (const BakedPart& part : run.baked) bytes += part.asset ? static_cast<double>(part.asset->bytes().size()) : 0;
  if (!run.arguments.full && run.scene.memory.value > 0 && bytes > run.scene.memory.value) {
    throw SceneError(run.scene.memory.place,
                     fmt::format("the assets take {}, more than the {} wished; wish more memory or coarser voxels",
                                 bake::format_bytes(bytes), bake::format_bytes(run.scene.memory.value)));
  }
}

// The manifest comes last: where it is, its assets are. Those that only its predecessor had go with it.
std::string write_scene(SceneRun& run, const fs::path& folder) {
  std::error_code failed;
  fs::create_directory(folder, failed);
  if (failed) throw WriteError("the folder cannot be made; choose another with -o");
  for (std::size_t i = 0; i < run.plan.assets.size(); ++i) {
    if (run.baked[i].asset != nullptr) write_whole(folder / run.plan.assets[i].file, run.baked[i].asset->bytes());
  }
  const fs::path manifest = manifest_file(run.arguments, folder);
  const std::string text = to_text(to_manifest(run.scene, run.meshes, run.plan, run.baked));
  if (text.size() > scene_manifest::kMostBytes)
    throw SceneError({run.arguments.scene, 1}, "the manifest would be larger than 64 MiB; leave bodies out");
  const std::set<std::string> former = assets_of(manifest);
  write_whole(manifest, std::as_bytes(std::span(text)));
  run.removed = remove_unlisted(folder, former);
  return manifest.string();
}

// Advice of the baker, which speaks of the command line, in the words of a scene.
std::string in_words_of(const Place& place, std::string text) {
  if (fs::path(place.file).extension() != ".toml") return text;
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"--open-surface thicken=2mm", "thicken = \"2mm\""},
      {"--repair fill", "repair = \"fill\""},
      {"--repair wrap", "repair = \"wrap\""},
      {"--repair", "repair"},
      {"--unit", "unit"}};
  for (const auto& [option, key] : kWords) {
    for (std::size_t at = 0; (at = text.find(option, at)) != std::string::npos; at += key.size())
      text.replace(at, option.size(), key);
  }
  return text;
}

int run_scene(const SceneArguments& arguments) {
  SceneRun run{arguments};
  const fs::path folder = output_folder(arguments);
  try {
    run.scene = read_scene(arguments.scene);
    run.meshes = read_meshes(run.scene);
    doubt_units(run.scene, run.meshes);
    run.plan = plan_scene(run.scene, run.meshes);
    run.baked.resize(run.plan.assets.size());
    for (PlannedAsset& asset : run.plan.assets) name_asset(run, asset);
    if (!arguments.dry_run) {
      if (const std::string reason = folder_refusal(folder); !reason.empty()) return fail(kIo, folder.string(), reason);
      if (!outputs_are_free(run, folder)) return kIo;
    }
    check_meshes(run);
    std::string manifest;
    if (!arguments.dry_run) {
      bake_scene(run);
      if (!outputs_are_free(run, folder)) return kIo;  // names change where an asset had to be finer
      manifest = write_scene(run, folder);
    }
    // Of a full bake the plan is what it is compared with.
    if (arguments.full) {
      run.everything = std::move(run.baked);
      run.baked.assign(run.plan.assets.size(), {});
    }
    const SceneReport report{run.scene,      run.meshes,      run.plan, run.baked,  run.ordinary,
                             run.everything, arguments.scene, manifest, run.removed};
    fmt::print("{}", arguments.json ? to_text(to_json(report)) : to_text(report));
    if (!arguments.json && !manifest.empty()) fmt::print("{}\n", manifest);
    return kOk;
  } catch (const SceneError& error) {
    const Place& place = error.place;
    return fail(error.kind == SceneError::Kind::io ? kIo : kBadInput,
                place.line == 0 ? place.file : fmt::format("{}:{}", place.file, place.line),
                in_words_of(place, error.what()));
  } catch (const WriteError& error) {
    return fail(kIo, folder.string(), error.what());
  }
}

}  // namespace

Command add_scene_command(CLI::App& app) {
  CLI::App* const scene =
      app.add_subcommand("scene", "Bake what the bodies of a scene need of each other, and nothing else");
  const auto arguments = std::make_shared<SceneArguments>();
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) arguments->cache = folder;
  scene->add_option("SCENE", arguments->scene, "Scene: a .toml or a .urdf file (docs/scene.md)")->required();
  scene
      ->add_option("-o,--output", arguments->output,
                   "Folder for the assets and the manifest NAME.vps.json [default: NAME.vps beside the scene]")
      ->check(not_empty())
      ->option_text("DIR");
  auto* const dry = scene->add_flag("--dry-run", arguments->dry_run, "Print the plan, bake and write nothing");
  auto* const full = scene->add_flag("--full", arguments->full, "Bake everything: both parts and all fields");
  auto* const compare =
      scene->add_flag("--compare", arguments->compare, "Bake as usual and everything too, to measure what is saved");
  dry->excludes(full, compare);
  full->excludes(compare);
  scene->add_flag("--json", arguments->json, "Print JSON");
  scene
      ->add_option("--cache", arguments->cache,
                   "Take what was baked before from this folder, and keep there what is new [default: VPSBAKE_CACHE]")
      ->check(not_empty())
      ->option_text("DIR");
  scene->footer("Example: vpsbake scene table.toml --dry-run");
  return {scene, [arguments] { return guarded(arguments->scene, [&] { return run_scene(*arguments); }); }};
}

}  // namespace vps::cli

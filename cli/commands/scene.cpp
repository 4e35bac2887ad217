// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <utility>

#include "cli/scene/bake_scene.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/progress.h"
#include "cli/terminal/stage_words.h"
#include "cli/tools/describe_asset.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

struct SceneArguments {
  std::string scene;
  std::string output;  // folder; empty: NAME.vps beside the scene
  std::string cache;   // folder of an AssetCache; empty: none
  bool dry_run = false, full = false, compare = false, json = false;
  Verbosity verbosity = Verbosity::usual;
};

fs::path output_folder(const SceneArguments& arguments) {
  if (!arguments.output.empty()) return arguments.output;
  fs::path folder = arguments.scene;
  return folder.replace_extension(".vps");
}

// Rewrites the baker's advice for a scene file: command-line options become keys of TOML.
std::string in_words_of(const Place& place, std::string text) {
  const std::string before = text;
  constexpr std::string_view kThicken = "--open-surface thicken=";
  for (std::size_t at = 0; (at = text.find(kThicken, at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find(' ', at + kThicken.size()), text.size());
    text.insert(end, "\"");
    text.replace(at, kThicken.size(), "thicken = \"");
  }
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {{"--repair fill", "repair = \"fill\""},
                                                                      {"--repair wrap", "repair = \"wrap\""},
                                                                      {"--repair", "repair"},
                                                                      {" or a higher --memory", ""},
                                                                      {"--unit", "unit"}};
  for (const auto& [option, key] : kWords) {
    for (std::size_t at = 0; (at = text.find(option, at)) != std::string::npos; at += key.size())
      text.replace(at, option.size(), key);
  }
  const bool is_toml = fs::path(place.file).extension() == ".toml";
  return text + (is_toml || text == before ? "" : ", in a TOML that names the URDF");
}

int fail_output(const RefusedFile& refused) {
  return fail(kIo, refused.file.string(), refused.reason);
}

void print_scene(SceneRun& run, const std::string& manifest, bool json) {
  // A full bake is reported as `everything`; the report compares it with the plan.
  if (run.options.full) {
    run.everything = std::move(run.baked);
    run.baked.assign(run.plan.assets.size(), {});
  }
  const SceneReport report{
      run.scene, run.meshes, run.plan, run.baked, run.ordinary, run.everything, run.options.scene.string(),
      manifest,  run.removed};
  if (json) return fmt::print("{}", to_text(to_json(report)));
  print_lines("{}", to_text(report));
  if (!manifest.empty()) print_lines("{}\n", manifest);
}

int run_scene(const SceneArguments& arguments) {
  const fs::path folder = output_folder(arguments);
  SceneRun run{{arguments.scene, folder, arguments.cache, arguments.full, arguments.compare, arguments.dry_run, {}}};
  try {
    const Progress progress(arguments.verbosity);  // erased before errors
    run.options.warn = [&](const std::string& reason) {
      progress.clear();
      complain("warning", arguments.cache, reason + "; the asset is not kept there");
    };
    run.options.progress = [&](const fs::path& mesh, const char* stage, double fraction) {
      progress.show(mesh.filename().string() + ": " + stage_words(stage), fraction);
    };
    progress.show("reading the meshes", 0);
    plan_run(run);
    progress.clear();
    const bool writes = !arguments.dry_run;
    if (writes) {
      if (const auto refused = refused_output(run)) return fail_output(*refused);
    }
    check_meshes(run);
    if (writes) bake_scene(run);
    progress.clear();
    std::string manifest;
    if (writes) {
      // The names of assets change where the bake chose finer voxels, so they are checked again.
      if (const auto refused = refused_output(run)) return fail_output(*refused);
      manifest = write_scene(run);
    }
    if (arguments.json || arguments.verbosity != Verbosity::quiet) print_scene(run, manifest, arguments.json);
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
      ->check(not_stream())
      ->option_text("DIR");
  auto* const dry = scene->add_flag("--dry-run", arguments->dry_run, "Print the plan, bake and write nothing");
  auto* const full = scene->add_flag("--full", arguments->full, "Bake everything: both parts and all fields");
  auto* const compare =
      scene->add_flag("--compare", arguments->compare, "Bake as usual and everything too, to measure what is saved");
  dry->excludes(full, compare);
  full->excludes(compare);
  scene->add_flag("--json", arguments->json, "Print JSON");
  add_verbosity_options(*scene, arguments->verbosity, "Print errors and warnings only", nullptr);
  scene
      ->add_option("--cache", arguments->cache,
                   "Take what was baked before from this folder, and keep there what is new [default: VPSBAKE_CACHE]")
      ->check(not_stream())
      ->option_text("DIR");
  scene->footer("Example: vpsbake scene table.toml --dry-run");
  return {scene, [arguments] { return guarded(arguments->scene, [&] { return run_scene(*arguments); }); }, true};
}

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bakes the assets of a plan and writes them into a folder, with their manifest.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/scene/report_scene.h"

namespace vps::cli {

struct SceneBakeOptions {
  std::filesystem::path scene;   ///< the scene's file
  std::filesystem::path folder;  ///< for the assets and the manifest
  std::string cache;             ///< folder of an AssetCache; empty: none
  bool full = false;             ///< bakes both parts and all fields
  bool compare = false;          ///< also bakes ordinary and full assets, to compare
  bool dry_run = false;
  std::function<void(const std::string& warning)> warn;  ///< of the cache, without a full stop; may be empty
  /// Takes the mesh in work, its stage as BakeOptions::progress has it, and the finished fraction of all bakes, 0 to 1.
  /// Called from any thread, by one at a time. May be empty.
  std::function<void(const std::filesystem::path& mesh, const char* stage, double fraction)> progress = {};
};

/// A scene on its way from the file to its assets.
struct SceneRun {
  SceneBakeOptions options;
  Scene scene = {};
  std::vector<SceneMesh> meshes = {};
  ScenePlan plan = {};
  std::vector<BakedPart> baked = {}, ordinary = {}, everything = {};
  std::vector<std::string> removed = {};  ///< assets of an earlier plan
  double seconds = 0, seconds_done = 0;   ///< predicted, of all bakes and of those that have ended
};

/// A file that cannot be written. `reason` is "reason; what to do".
struct RefusedFile {
  std::filesystem::path file;
  std::string reason;
};

/// Reads the scene and its meshes and plans its assets. @throw SceneError
void plan_run(SceneRun& run);

/// The first output that cannot be written, as far as a check beforehand shows; nothing when all can.
[[nodiscard]] std::optional<RefusedFile> refused_output(const SceneRun& run);

/// Refuses meshes that cannot be baked, before the first bake and in a dry run. @throw SceneError
void check_meshes(const SceneRun& run);

/// Bakes the assets or takes them from the cache, and refines them until they keep the wished error.
/// @throw SceneError, WriteError
void bake_scene(SceneRun& run);

/// Writes the assets and then the manifest, so that a manifest's assets always exist. Removes assets that only the
/// former manifest lists.
/// @return the manifest's path
/// @throw SceneError, WriteError
std::string write_scene(SceneRun& run);

}  // namespace vps::cli

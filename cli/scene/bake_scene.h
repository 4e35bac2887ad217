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
  std::filesystem::path scene;   ///< file
  std::filesystem::path folder;  ///< of the assets and the manifest
  std::string cache;             ///< folder of an AssetCache; empty: none
  bool full = false;             ///< everything: both parts and all fields
  bool compare = false;          ///< what is usual and everything as well
  bool dry_run = false;
  std::function<void(const std::string& warning)> warn;  ///< of the cache, without a full stop; may be empty
};

/// A scene on its way from the file to its assets.
struct SceneRun {
  SceneBakeOptions options;
  Scene scene = {};
  std::vector<SceneMesh> meshes = {};
  ScenePlan plan = {};
  std::vector<BakedPart> baked = {}, ordinary = {}, everything = {};
  std::vector<std::string> removed = {};  ///< assets of an earlier plan
};

/// A file that cannot be written, and why: "reason; what to do".
struct RefusedFile {
  std::filesystem::path file;
  std::string reason;
};

/// Reads the scene and its meshes and plans its assets. @throw SceneError
void plan_run(SceneRun& run);

/// The first output that cannot be written, as far as a check beforehand shows; nothing when all can.
[[nodiscard]] std::optional<RefusedFile> refused_output(const SceneRun& run);

/// Meshes that cannot be baked are refused before anything is, also in a dry run. @throw SceneError
void check_meshes(const SceneRun& run);

/// Bakes, or takes from the cache, and refines assets until the wished error holds. @throw SceneError, WriteError
void bake_scene(SceneRun& run);

/// The manifest comes last: where it is, its assets are. Those that only its predecessor had go with it.
/// @return the manifest's name
/// @throw SceneError, WriteError
std::string write_scene(SceneRun& run);

}  // namespace vps::cli

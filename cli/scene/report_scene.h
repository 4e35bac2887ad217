// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reports what was planned and baked, and what the plan saves, as text and as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "cli/scene/plan_scene.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

/// One baked asset.
struct BakedPart {
  std::shared_ptr<const Asset> asset;  ///< null: not baked, as in a dry run
  double seconds = 0;                  ///< of baking; 0 when it came from the cache
  bool from_cache = false;
  std::vector<std::string> notes;
};

struct SceneReport {
  const Scene& scene;
  const std::vector<SceneMesh>& meshes;
  const ScenePlan& plan;
  std::vector<BakedPart> baked;       ///< one for each asset of the plan
  std::vector<BakedPart> ordinary;    ///< with --compare, otherwise empty
  std::vector<BakedPart> everything;  ///< with --compare or --full, otherwise empty
  std::string scene_file, manifest;   ///< manifest: empty in a dry run
  std::vector<std::string> removed;   ///< assets of an earlier plan
};

/// As in docs/schemas/scene_report.schema.json.
[[nodiscard]] nlohmann::ordered_json to_json(const SceneReport& report);
[[nodiscard]] std::string to_text(const SceneReport& report);

/// Bound on the error of a distance between surfaces: the largest sum of a field's certified bound and a shell's
/// covering radius over the pairs that can meet. [m]
[[nodiscard]] double reached_error(const ScenePlan& plan, const std::vector<BakedPart>& baked);

}  // namespace vps::cli

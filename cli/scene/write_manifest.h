// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The manifest of a planned scene, which vps::bullet::load_scene reads.
#pragma once

#include <nlohmann/json.hpp>

#include "cli/scene/report_scene.h"

namespace vps::cli {

/// The first bytes of a manifest.
inline constexpr std::string_view kManifestBeginning = "{\n  \"format\": \"vps-scene\"";

/// As in docs/schemas/scene_manifest.schema.json. Meshes of bodies that meet no other become boxes that collide with
/// nothing.
/// @param baked  one for each asset of the plan
[[nodiscard]] nlohmann::ordered_json to_manifest(const Scene& scene, const std::vector<SceneMesh>& meshes,
                                                 const ScenePlan& plan, const std::vector<BakedPart>& baked);

/// "voxelmap", "pointshell", "mixed", or "nothing".
[[nodiscard]] const char* part_name(Use parts);
/// "static", "kinematic", "dynamic".
[[nodiscard]] const char* motion_name(Motion motion);
/// "mesh", "box" and so on.
[[nodiscard]] const char* solid_name(Solid solid);

}  // namespace vps::cli

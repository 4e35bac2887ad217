// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Plans a scene: which bodies can meet, which part each shape uses, and how fine it is. Bakes nothing.
#pragma once

#include <string>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/scene/meeting.h"
#include "cli/scene/scene.h"
#include "cli/scene/scene_mesh.h"

namespace vps::cli {

/// Share of a wished error for the bound of the field's certificate. The rest is for the shell's covering radius.
inline constexpr double kFieldShare = 0.25;

/// One asset to bake, shared by all shapes with the same mesh and the same options.
struct PlannedAsset {
  std::size_t mesh = 0;
  std::string file;              ///< name from asset_file, without folders; empty until it is set
  bake::BakeOptions options;     ///< without voxelmap and pointshell nothing is baked
  bake::BakeOptions ordinary;    ///< both parts with field scaled only, like `vpsbake MESH`, as fine as `options`
  bake::BakeOptions everything;  ///< both parts and all fields, as fine as `options`
  bake::BakePlan predicted, predicted_ordinary, predicted_everything;
  double seconds = 0, seconds_ordinary = 0,
         seconds_everything = 0;  ///< predicted, on a machine as in docs/scene.md. [s]
  Place place;                    ///< of the first shape that uses it
  [[nodiscard]] bool is_needed() const { return options.voxelmap || options.pointshell; }
};

struct PlannedShape {
  std::size_t body = 0, shape = 0;
  std::size_t asset = kNone;  ///< kNone: one of Bullet's own shapes
  Use parts{};                ///< scaled, pointshell, both, or none
  std::uint32_t segments = 0;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
};

struct ScenePlan {
  std::vector<PlannedAsset> assets;
  std::vector<PlannedShape> shapes;      ///< of all bodies, in their order
  std::vector<std::size_t> first_shape;  ///< index of each body's first shape, then the number of all shapes
  Meeting meeting;
  double seconds_per_step = 0;  ///< estimated narrowphase. [s]
  std::size_t bytes = 0;        ///< predicted, of all assets
};

/// @throw SceneError naming the line of a wish that cannot be met
[[nodiscard]] ScenePlan plan_scene(const Scene& scene, const std::vector<SceneMesh>& meshes);

/// Name of an asset's file, without folders: the mesh's stem, shortened where it is long, and 8 digits of the
/// cache_key, so that equal names mean equal bytes.
[[nodiscard]] std::string asset_file(const SceneMesh& mesh, const bake::BakeOptions& options);

/// Makes an asset's voxels finer, after a bake that missed the wished error.
/// @param by  factor. [Limits: value > 1]
void refine(PlannedAsset& asset, double by);

}  // namespace vps::cli

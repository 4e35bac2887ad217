// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Works out what a scene needs: who can meet whom, who plays which part, and how fine. Bakes nothing.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bake/vps_bake.h"
#include "cli/scene/scene.h"
#include "cli/scene/scene_mesh.h"

namespace vps::cli {

/// Of a wished error, for the bound of the field's certificate; the rest is for the shell's covering radius.
inline constexpr double kFieldShare = 0.25;

/// One asset to bake, for all shapes whose mesh is the same and is baked alike.
struct PlannedAsset {
  std::size_t mesh = 0;
  std::string file;              ///< by asset_file, without folders; empty until the program names it
  bake::BakeOptions options;     ///< neither voxelmap nor pointshell: nothing is baked
  bake::BakeOptions ordinary;    ///< both parts with scaled alone, as `vpsbake MESH` bakes, as fine
  bake::BakeOptions everything;  ///< both parts and all fields, as fine
  bake::BakePlan predicted, predicted_ordinary, predicted_everything;
  double seconds = 0, seconds_ordinary = 0,
         seconds_everything = 0;  ///< predicted, on a machine as in docs/scene.md. [s]
  Place place;                    ///< of the first shape
  [[nodiscard]] bool is_needed() const { return options.voxelmap || options.pointshell; }
};

struct PlannedShape {
  std::size_t body = 0, shape = 0;
  std::size_t asset = kNone;  ///< kNone: one of Bullet's own
  Use parts{};                ///< scaled, pointshell, both, or none
  std::uint32_t segments = 0;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
};

struct ScenePlan {
  std::vector<PlannedAsset> assets;
  std::vector<PlannedShape> shapes;                        ///< of all bodies, in their order
  std::vector<std::size_t> first_shape;                    ///< of each body, and the number of all
  std::set<std::pair<std::size_t, std::size_t>> meeting;   ///< bodies that can ever meet, the smaller number first
  std::vector<std::pair<std::size_t, std::size_t>> apart;  ///< that Bullet has to be told to keep apart
  double seconds_per_step = 0;                             ///< estimated narrowphase. [s]
  std::size_t bytes = 0;                                   ///< predicted, of all assets
  std::vector<std::vector<std::size_t>> partners;          ///< of each body: whom it can meet
};

/// @throw SceneError naming the line of a wish that cannot be met
[[nodiscard]] ScenePlan plan_scene(const Scene& scene, const std::vector<SceneMesh>& meshes);

/// Name of an asset's file, without folders: the mesh's stem, shortened where it is long, and 8 digits of the
/// cache_key, so that a name means the same bytes wherever it is.
[[nodiscard]] std::string asset_file(const SceneMesh& mesh, const bake::BakeOptions& options);

/// Makes an asset finer by what a bake has shown, so that a wished error is met.
/// @param by  above 1
void refine(PlannedAsset& asset, double by);

}  // namespace vps::cli

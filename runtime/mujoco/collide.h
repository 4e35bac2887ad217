// SPDX-License-Identifier: Zlib
/// @file What the collision functions know of a model. Internal.
#pragma once

#include <vector>

#include "runtime/mujoco/vps_mujoco.h"

namespace vps::mujoco {

/// A mesh that collides as an asset.
struct BakedMesh {
  std::shared_ptr<const Asset> asset;  ///< null: the mesh is not baked
  PointshellView shell;
  VoxelmapView map;
  Pose asset_in_geom;  ///< takes the asset's frame to that of the mesh's geoms
  int contacts = 0;
  StepUse use{};
};

/// By the number of a mesh in the model.
struct Meshes {
  std::vector<BakedMesh> baked;
  std::vector<std::vector<HalfSpaceField>> hulls;  ///< planes of convex hulls, geoms' frame; none: of too many faces
};

/// Pose of a frame that is given in another one.
inline Pose compose(const Pose& frame, const Pose& inner) noexcept {
  return relative_pose(relative_pose(frame, Pose()), inner);
}

/// Replaces the entries of MuJoCo's table and gives them the meshes of a model.
/// @return false: the model has others
[[nodiscard]] bool add_meshes(const mjModel& model, const Meshes& meshes);
/// Takes them away.
void remove_meshes(const mjModel& model);

}  // namespace vps::mujoco

// SPDX-License-Identifier: Zlib
/// @file Baked assets as the collision geometry of meshes in an unpatched MuJoCo 2.2. docs/mujoco.md
///
///     mjModel* model = mj_loadXML("nut.xml", nullptr, error, sizeof error);
///     vps::mujoco::BakedModel baked(*model);                   // before the first step; ends before the model
///     if (const auto wrong = baked.bake("nut", asset); !wrong.empty()) ...    // geoms of the mesh named "nut"
///
/// A baked geom meets other baked ones, planes, spheres, capsules, cylinders, boxes, and meshes that are not baked, by
/// their convex hulls. With ellipsoids and height fields MuJoCo's own functions go on, on the hull of its mesh.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

#include "runtime/vps_contacts.h"

namespace vps::mujoco {

struct MeshOptions {
  /// Pose of the mesh in the body of its first geom: that geom's `pos` and orientation in the XML. MuJoCo moves a mesh
  /// to its centre and axes of inertia, and its model does not say where from. Null: one of the mesh's geoms has none
  /// in the XML, which is found out.
  const Pose* in_body = nullptr;
  /// At most, with any other geom. Of two baked geoms the one with more contacts decides, on their use too.
  /// [Limits: 1 <= value <= mjMAXCONPAIR]
  int contacts = 16;
  /// `samples` for parts that fit closely and slide along each other, as a nut on its bolt; never `springs`.
  StepUse use = StepUse::constraints;
};

/// The baked meshes of one model. Its geoms collide by MuJoCo's table of collision functions (mjCOLLISIONFUNC), whose
/// entries for meshes are replaced when the first BakedModel is made. Any number of threads may step the model, each
/// with its own mjData; none while meshes are baked, or while this ends. The contacts depend on the poses alone, as
/// MuJoCo's do. A model has one BakedModel; a copy of the model needs one of its own.
class BakedModel {
 public:
  /// @param model  must outlive this
  explicit BakedModel(const mjModel& model);
  BakedModel(const BakedModel&) = delete;
  BakedModel& operator=(const BakedModel&) = delete;
  /// Its geoms collide as MuJoCo's hulls again.
  ~BakedModel();

  /// All geoms of a mesh collide as the asset from now on.
  /// @param mesh   its name in the model
  /// @param asset  open, with pointshell and voxelmap, baked from the same mesh at the size that it has in the model
  /// @return empty, or what is wrong and what to do; then nothing has changed
  [[nodiscard]] std::string bake(const std::string& mesh, std::shared_ptr<const Asset> asset,
                                 const MeshOptions& options = {});

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace vps::mujoco

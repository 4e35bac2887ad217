// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/write_manifest.h"

#include "formats/scene_manifest.h"
#include "version.h"

namespace vps::cli {
namespace {

using Json = nlohmann::ordered_json;

void add_pose(Json& json, const Placement& pose) {
  const Placement at_origin;
  if (pose.position != at_origin.position) json["position"] = pose.position;
  if (pose.orientation != at_origin.orientation) json["orientation"] = pose.orientation;
}

// A box as large as a mesh that was not baked.
SceneShape bounds_of(const SceneMesh& mesh, const Placement& pose) {
  SceneShape box;
  box.solid = Solid::box;
  Placement centre;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    constexpr double kThinnest = 1e-6;
    box.half_extents[axis] = std::max(kThinnest, (mesh.bounds_max[axis] - mesh.bounds_min[axis]) / 2);
    centre.position[axis] = (mesh.bounds_max[axis] + mesh.bounds_min[axis]) / 2;
  }
  box.pose = composed(pose, centre);
  return box;
}

Json primitive_to_json(const SceneShape& shape) {
  Json json = {{"primitive", solid_name(shape.solid)}};
  if (shape.solid == Solid::box) json["half_extents"] = shape.half_extents;
  if (shape.radius > 0) json["radius"] = shape.radius;
  if (shape.half_height > 0) json["half_height"] = shape.half_height;
  add_pose(json, shape.pose);
  return json;
}

void add_mass(Json& json, const SceneBody& body) {
  json["mass"] = body.mass;
  if (!body.inertia) return;
  const std::array<double, 6>& i = *body.inertia;
  json["inertia"] = {i[0], i[1], i[2]};
  if (i[3] != 0 || i[4] != 0 || i[5] != 0) json["inertia"] = i;
}

Json link_to_json(const SceneBody& link) {
  Json json = {{"name", link.name}};
  add_mass(json, link);
  json["centre_of_mass"] = *link.centre_of_mass;
  return json;
}

Json joint_to_json(const SceneJoint& joint) {
  constexpr const char* kTypes[] = {"revolute", "continuous", "prismatic"};
  Json json = {{"name", joint.name}, {"type", kTypes[static_cast<std::size_t>(joint.type)]}};
  if (!joint.parent.empty()) json["parent"] = joint.parent;
  json["child"] = joint.child;
  add_pose(json, joint.pose);
  json["axis"] = joint.axis;
  if (joint.limits) {
    json["lower"] = joint.limits->first;
    json["upper"] = joint.limits->second;
  }
  return json;
}

Json body_to_json(const SceneBody& body, bool meets) {
  Json json = {{"name", body.name}, {"type", motion_name(body.motion)}};
  if (body.motion == Motion::dynamic) {
    add_mass(json, body);
    if (body.velocity != Triple{}) json["velocity"] = body.velocity;
  }
  if (body.centre_of_mass) json["centre_of_mass"] = *body.centre_of_mass;
  add_pose(json, body.pose);
  json["group"] = meets ? body.group : 0;
  json["mask"] = meets ? body.mask : 0;
  json["friction"] = body.friction;
  json["restitution"] = body.restitution;
  return json;
}

}  // namespace

const char* part_name(Use parts) {
  const bool map = overlap(parts, Use::voxelmap);
  const bool shell = overlap(parts, Use::pointshell);
  return map && shell ? "mixed" : (map ? "voxelmap" : (shell ? "pointshell" : "nothing"));
}

const char* motion_name(Motion motion) {
  return motion == Motion::fixed ? "static" : (motion == Motion::kinematic ? "kinematic" : "dynamic");
}

const char* solid_name(Solid solid) {
  constexpr const char* kNames[] = {"mesh", "box", "sphere", "capsule", "cylinder", "plane"};
  return kNames[static_cast<std::size_t>(solid)];
}

Json to_manifest(const Scene& scene, const std::vector<SceneMesh>& meshes, const ScenePlan& plan,
                 const std::vector<BakedPart>& baked) {
  Json manifest = {
      {"format", "vps-scene"}, {"version", 1}, {"generator", "vpsbake " VPSBAKE_VERSION}, {"step", scene.step}};
  if (scene.gravity) manifest["gravity"] = *scene.gravity;
  manifest["assets"] = Json::array();
  std::vector<std::size_t> numbers;  // index of each asset in the manifest
  for (std::size_t i = 0; i < plan.assets.size(); ++i) {
    const PlannedAsset& asset = plan.assets[i];
    numbers.push_back(manifest["assets"].size());
    if (!asset.is_needed()) continue;
    Json use = Json::array();
    if (asset.options.voxelmap) use.push_back("scaled");
    if (asset.options.pointshell) use.push_back("pointshell");
    manifest["assets"].push_back(
        {{"file", asset.file}, {"key", scene_manifest::asset_key(baked[i].asset->bytes())}, {"use", use}});
  }
  manifest["bodies"] = Json::array();
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const SceneBody& body = scene.bodies[b];
    Json json = body_to_json(body, plan.meeting.partners(b) > 0 || overlap(body.keep, Use::everything));
    json["shapes"] = Json::array();
    for (std::size_t i = plan.first_shape[b]; i < plan.first_shape[b + 1]; ++i) {
      const PlannedShape& planned = plan.shapes[i];
      const SceneShape& shape = body.shapes[planned.shape];
      if (planned.asset == PlannedShape::kNone) {
        json["shapes"].push_back(primitive_to_json(shape));
      } else if (!overlap(planned.parts, Use::everything)) {
        json["shapes"].push_back(primitive_to_json(bounds_of(meshes[plan.assets[planned.asset].mesh], shape.pose)));
      } else {
        Json asset = {{"asset", numbers[planned.asset]}, {"part", part_name(planned.parts)}};
        if (planned.segments > 0) asset["segments"] = planned.segments;
        add_pose(asset, shape.pose);
        json["shapes"].push_back(asset);
      }
    }
    manifest["bodies"].push_back(json);
  }
  for (const SceneBody& link : scene.links) manifest["links"].push_back(link_to_json(link));
  for (const SceneJoint& joint : scene.joints) manifest["joints"].push_back(joint_to_json(joint));
  manifest["apart"] = Json::array();
  for (const auto& [a, b] : plan.meeting.apart())
    manifest["apart"].push_back({scene.bodies[a].name, scene.bodies[b].name});
  return manifest;
}

}  // namespace vps::cli

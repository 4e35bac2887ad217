// SPDX-License-Identifier: Zlib
// Finds where an asset lies in the geoms of its mesh, and the planes of hulls.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "runtime/fields/penetration.h"
#include "runtime/fields/place_field.h"
#include "runtime/mujoco/collide.h"

namespace vps::mujoco {
namespace {

using detail::operator-;
using detail::operator*;

Vec3 vertex_of(const mjModel& model, int mesh, int i) {
  const float* const v = model.mesh_vert + 3 * (model.mesh_vertadr[mesh] + i);
  return {v[0], v[1], v[2]};
}

// Planes of a mesh's convex hull, which MuJoCo keeps as a graph: counts of corners and faces, two numbers for each
// corner, edges, then three vertices for each face.
std::vector<HalfSpaceField> hull_of(const mjModel& model, int mesh) {
  constexpr std::size_t kMostPlanes = 256;  // each costs every query
  std::vector<HalfSpaceField> planes;
  if (model.mesh_graphadr[mesh] < 0) return planes;
  const int* const graph = model.mesh_graph + model.mesh_graphadr[mesh];
  const int corners = graph[0];
  const int faces = graph[1];
  const int* const face = graph + 2 + 3 * corners + 3 * faces;
  for (int i = 0; i < faces; ++i) {
    const Vec3 a = vertex_of(model, mesh, face[3 * i]);
    const Vec3 n =
        detail::cross(vertex_of(model, mesh, face[3 * i + 1]) - a, vertex_of(model, mesh, face[3 * i + 2]) - a);
    const float size = detail::length(n);
    if (!(size > 0)) continue;
    HalfSpaceField plane{(1 / size) * n, 0};
    plane.offset = detail::dot(plane.outward_normal, a);
    const auto is_same = [&](const HalfSpaceField& other) {
      return detail::dot(other.outward_normal, plane.outward_normal) > 1 - 1e-6F &&
             std::abs(other.offset - plane.offset) <= 1e-6F * std::abs(plane.offset);
    };
    if (std::none_of(planes.begin(), planes.end(), is_same)) planes.push_back(plane);
    if (planes.size() > kMostPlanes) return {};
  }
  return planes;
}

// Of a mesh that is the surface of an asset, in voxels: skins that the bake wraps round a mesh lie a quarter outside.
constexpr float kMostMisfit = 0.35F;

// How far most of a mesh's vertices are off the surface of an asset, at most. The others are those of parts that the
// bake united, and lie inside. Infinite when a vertex is outside. [m]
float misfit(const mjModel& model, int mesh, const VoxelmapView& map, const Pose& asset_in_geom) {
  const detail::Transform to_asset(relative_pose(asset_in_geom, Pose()));
  std::vector<float> off(static_cast<std::size_t>(model.mesh_vertnum[mesh]));
  for (std::size_t i = 0; i < off.size(); ++i) {
    const float v = penetration(map, to_asset.apply(vertex_of(model, mesh, static_cast<int>(i))), {});
    if (v < -map.voxel_size) return std::numeric_limits<float>::infinity();
    off[i] = std::abs(v);
  }
  if (off.empty()) return std::numeric_limits<float>::infinity();
  const auto most = off.begin() + static_cast<std::ptrdiff_t>((off.size() - 1) * 9 / 10);
  std::nth_element(off.begin(), most, off.end());
  return *most;
}

// The square of a point's distance from a triangle. [m^2]
float squared_distance(Vec3 p, Vec3 a, Vec3 b, Vec3 c) {
  using detail::dot;
  const Vec3 corners[3] = {a, b, c};
  const Vec3 normal = detail::cross(b - a, c - a);
  const float size = dot(normal, normal);
  float least = std::numeric_limits<float>::infinity();
  bool is_over = size > 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = corners[(i + 1) % 3] - corners[i];
    const Vec3 from = p - corners[i];
    is_over = is_over && dot(detail::cross(normal, edge), from) >= 0;
    const float along = dot(edge, edge) > 0 ? std::clamp(dot(from, edge) / dot(edge, edge), 0.0F, 1.0F) : 0.0F;
    const Vec3 off = from - along * edge;
    least = std::min(least, dot(off, off));
  }
  const float height = dot(p - a, normal);
  return is_over ? height * height / size : least;
}

// Whether all of an asset's surface, as far as some of its points tell, is a mesh's: a part may fit with most of its
// vertices though a hole is on its other side.
bool is_surface_of(const mjModel& model, int mesh, const PointshellView& shell, float voxel,
                   const Pose& asset_in_geom) {
  constexpr std::uint32_t kMostPoints = 2000;
  const float reach = 1.5F * voxel;  // skins, and chords of curved edges
  const detail::Transform to_geom(asset_in_geom);
  const int* const faces = model.mesh_face + 3 * model.mesh_faceadr[mesh];
  const std::uint32_t step = 1 + (shell.points - 1) / kMostPoints;
  for (std::uint32_t i = 0; i < shell.points; i += step) {
    const Vec3 p = to_geom.apply(point_position(shell, i));
    const auto is_near = [&](int face) {
      const Vec3 a = vertex_of(model, mesh, faces[3 * face]) - p;
      const Vec3 b = vertex_of(model, mesh, faces[3 * face + 1]) - p;
      const Vec3 c = vertex_of(model, mesh, faces[3 * face + 2]) - p;
      const auto is_aside = [&](float u, float v, float w) {
        return std::min({u, v, w}) > reach || std::max({u, v, w}) < -reach;
      };
      if (is_aside(a.x, b.x, c.x) || is_aside(a.y, b.y, c.y) || is_aside(a.z, b.z, c.z)) return false;
      return squared_distance({}, a, b, c) <= reach * reach;
    };
    int face = 0;
    while (face < model.mesh_facenum[mesh] && !is_near(face)) ++face;
    if (face == model.mesh_facenum[mesh]) return false;
  }
  return true;
}

// The pose of an asset in the frame of its mesh's geoms. Newer models have it: mesh_pos and mesh_quat.
// @param in_body  of the mesh, in the body of its first geom; null: in that of any geom it is none
std::optional<Pose> find_asset(const mjModel& model, int mesh, const BakedMesh& baked, const Pose* in_body) {
  const VoxelmapView& map = baked.map;
  std::optional<Pose> found;
  float least = kMostMisfit * map.voxel_size;
  for (int geom = 0; geom < model.ngeom; ++geom) {
    if (model.geom_type[geom] != mjGEOM_MESH || model.geom_dataid[geom] != mesh) continue;
    Pose at;
    mju_quat2Mat(at.rotation, model.geom_quat + 4 * geom);
    std::copy_n(model.geom_pos + 3 * geom, 3, at.translation);
    const Pose asset_in_geom = relative_pose(at, in_body != nullptr ? *in_body : Pose());
    // Filled holes are not the mesh's, so that a pose that is given is believed.
    if (const float off = misfit(model, mesh, map, asset_in_geom);
        off < least && (in_body != nullptr || is_surface_of(model, mesh, baked.shell, map.voxel_size, asset_in_geom))) {
      found = asset_in_geom;
      least = off;
    }
    if (in_body != nullptr) break;
  }
  return found;
}

}  // namespace

struct BakedModel::Content {
  const mjModel& model;
  Meshes meshes;
  bool is_first;  // of the model's
};

BakedModel::BakedModel(const mjModel& model) : content_(std::make_unique<Content>(Content{model, {}, true})) {
  content_->meshes.baked.resize(static_cast<std::size_t>(model.nmesh));
  for (int mesh = 0; mesh < model.nmesh; ++mesh) content_->meshes.hulls.push_back(hull_of(model, mesh));
  content_->is_first = add_meshes(model, content_->meshes);
}

BakedModel::~BakedModel() {
  if (content_->is_first) remove_meshes(content_->model);
}

std::string BakedModel::bake(const std::string& mesh, std::shared_ptr<const Asset> asset, const MeshOptions& options) {
  const mjModel& model = content_->model;
  const auto wrong = [&](const std::string& what) { return "mesh \"" + mesh + "\": " + what; };
  const int id = mj_name2id(&model, mjOBJ_MESH, mesh.c_str());
  if (id < 0) return wrong("the model has none of this name");
  if (!content_->is_first) return wrong("the model has another BakedModel; bake all its meshes with that one");
  BakedMesh baked;
  if (asset == nullptr || asset->pointshell(baked.shell) != Status::ok || asset->voxelmap(baked.map) != Status::ok) {
    return wrong("the asset is not open, or lacks its pointshell or voxelmap; bake both parts");
  }
  if (options.contacts < 1 || options.contacts > mjMAXCONPAIR) {
    return wrong("contacts must be 1 to " + std::to_string(mjMAXCONPAIR));
  }
  if (options.use == StepUse::springs) return wrong("MuJoCo's contacts have springs of their own; use samples");
  if (options.in_body != nullptr && check_pose(*options.in_body) != Status::ok) return wrong("in_body is no pose");
  const std::span geoms(model.geom_dataid, static_cast<std::size_t>(model.ngeom));
  if (std::find(geoms.begin(), geoms.end(), id) == geoms.end()) return wrong("no geom of the model has it");
  const std::optional<Pose> found = find_asset(model, id, baked, options.in_body);
  if (!found) {
    return wrong(
        "the asset's surface is not where a geom of this mesh is; give in_body, the geom's pose in the XML, "
        "and bake the mesh at its size in the model");
  }
  baked.asset_in_geom = *found;
  baked.contacts = options.contacts;
  baked.use = options.use;
  baked.asset = std::move(asset);
  content_->meshes.baked[static_cast<std::size_t>(id)] = std::move(baked);
  return {};
}

}  // namespace vps::mujoco

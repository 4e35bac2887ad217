// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/plan_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <queue>
#include <tuple>

#include "bake/quantity_text.h"
#include "bake/store/cache.h"
#include "cli/tools/differing_numbers.h"
#include "formats/scene_manifest.h"
#include "runtime/contacts/gives_pointshell.h"

namespace vps::cli {
namespace {

// Default number of voxels along a body's longest side, and the smallest sensible one.
constexpr double kUsualResolution = 200;
constexpr double kLeastResolution = 32;

// For planning with a wished error: see docs/internals/decisions.md.
constexpr double kFieldBound_vx = 0.24;    // certificates' bound: 0.22 where samples were placed for 0.1 voxel
constexpr double kCoverPerSpacing = 1.12;  // covering radius: 1.05 for the bunny

// Narrowphase time of a pair in contact, on the machine of docs/internals/benchmarks/query.md. 99 % of 400 poses of two
// bunnies, of 36,296 and 74,236 points, took less than 31.6 and 48.7 us. 99 % of their steps on a plane took less than
// 3 us.
constexpr double kPair = 5e-6;
constexpr double kPairPerRootPoint = 0.16e-6;
constexpr double kPrimitive = 1e-6;
constexpr double kPrimitivePerRootPoint = 0.01e-6;
constexpr std::size_t kNeighbours = 12;  // number of bodies of about the same size that touch one at once

// A single manifold keeps the paper's bunny on its plane down to 30 Hz, segments down to 10 Hz (Sec. 4).
constexpr double kLongStep = 1.0 / 30;
constexpr std::uint32_t kSegments = 15;

bool is_mesh(const SceneShape& shape) {
  return shape.solid == Solid::mesh;
}

[[noreturn]] void refuse_wish(const Wish& wish, const std::string& reason) {
  throw SceneError(wish.place, reason);
}

void choose_grid(const Scene& scene, const SceneShape& shape, double longest, double resolution,
                 bake::BakeOptions& options) {
  options.voxel_size = shape.voxel_size > 0 ? shape.voxel_size : longest / resolution;
  if (scene.error.value == 0) return;
  const double field = kFieldShare * scene.error.value / kFieldBound_vx;
  const double spacing = (1 - kFieldShare) * scene.error.value / kCoverPerSpacing;
  const bake::BakeOptions defaults;
  constexpr double kLeastAlpha = 0.25;
  if (shape.voxel_size > field) {
    throw SceneError(shape.place, fmt::format("voxels of {} are coarser than the {} that the wished error needs; leave "
                                              "voxel out",
                                              bake::format_length(shape.voxel_size), bake::format_length(field)));
  }
  if (shape.voxel_size == 0) options.voxel_size = std::min(field, longest / kLeastResolution);
  options.alpha = std::clamp(spacing / options.voxel_size, kLeastAlpha, defaults.alpha);
}

// Chooses the bands of the asset's voxelmap. A slow body enters or leaves it by no more than its travel in a step.
void choose_bands(const Scene& scene, const ScenePlan& plan, std::size_t asset, bake::BakeOptions& options) {
  double travel = 0;
  bool bounces = false;
  bool known = true;
  bool meets = false;
  for (const PlannedShape& shape : plan.shapes) {
    if (shape.asset != asset) continue;
    meets = meets || plan.meeting.partners(shape.body) > 0;
    plan.meeting.for_each_partner(shape.body, [&](std::size_t other) {
      const SceneBody& a = scene.bodies[shape.body];
      const SceneBody& b = scene.bodies[other];
      const auto speed = [&](const SceneBody& body) {
        if (body.speed) return std::max(*body.speed, std::hypot(body.velocity[0], body.velocity[1], body.velocity[2]));
        known = known && body.motion == Motion::fixed;
        return 0.0;
      };
      travel = std::max(travel, scene.step * (speed(a) + speed(b)) / options.voxel_size);
      bounces = bounces || a.restitution * b.restitution > 0;
      return known;  // else the defaults count
    });
  }
  if (!known || !meets) return;
  const bake::BakeOptions defaults;
  // Speculative contacts hold bodies at the surface, except with restitution. Beyond the band the closest point is
  // used.
  options.band_inside = std::clamp(travel, 2.0, bounces ? 8.0 : defaults.band_inside);
  options.band_outside = std::clamp(travel, 2.0, defaults.band_outside);
}

// Calls visit(first, second) for the shapes of each pair of bodies that can meet.
template <class Visit>
void for_each_pair(ScenePlan& plan, const Visit& visit) {
  plan.meeting.for_each_pair([&](std::size_t a, std::size_t b) {
    for (std::size_t i = plan.first_shape[a]; i < plan.first_shape[a + 1]; ++i) {
      for (std::size_t j = plan.first_shape[b]; j < plan.first_shape[b + 1]; ++j) visit(plan.shapes[i], plan.shapes[j]);
    }
  });
}

ShellSide side_of(const ScenePlan& plan, const PlannedShape& shape) {
  const PlannedAsset& asset = plan.assets[shape.asset];
  return {asset.options.voxel_size, asset.predicted_everything.predicted_points};
}

// The same roles as at run time. Against Bullet's own shapes the mesh uses its pointshell.
void choose_parts(const Scene& scene, ScenePlan& plan) {
  const auto add = [&](PlannedShape& shape, Use part) { shape.parts = shape.parts | part; };
  for (PlannedShape& shape : plan.shapes) {
    if (shape.asset != PlannedShape::kNone) add(shape, scene.bodies[shape.body].keep);
  }
  for_each_pair(plan, [&](PlannedShape& a, PlannedShape& b) {
    if (a.asset == PlannedShape::kNone || b.asset == PlannedShape::kNone) {
      if (a.asset != PlannedShape::kNone) add(a, Use::pointshell);
      if (b.asset != PlannedShape::kNone) add(b, Use::pointshell);
    } else if (a.asset == b.asset) {
      // Bullet decides which of the two comes first.
      add(a, Use::scaled | Use::pointshell);
      add(b, Use::scaled | Use::pointshell);
    } else {
      const bool first = gives_pointshell(side_of(plan, a), side_of(plan, b));
      add(first ? a : b, Use::pointshell);
      add(first ? b : a, Use::scaled);
    }
  });
}

// Seconds of baking, fitted to 60 bakes of ten meshes on two cores. Three in four are within a factor of 1.5, the worst
// is at 4.4.
// @param all  plan with both parts and all fields, whose voxelmap takes 22 bytes for each scaled sample
double predict_seconds(const bake::BakePlan& all, const bake::BakeOptions& options, std::size_t triangles) {
  if (!options.voxelmap && !options.pointshell) return 0;
  const auto points = static_cast<double>(all.predicted_points);
  const double surface_voxels = points * options.alpha * options.alpha / 0.81;
  const double samples = std::max(0.0, static_cast<double>(all.predicted_asset_bytes) - 14.3 * points) / 22;
  double seconds = 0.03 + 35e-9 * surface_voxels + 18e-6 * static_cast<double>(triangles);
  if (options.voxelmap) seconds += 340e-9 * surface_voxels + 0.25e-6 * samples;
  if (options.real) seconds += 0.26e-6 * samples;
  if (options.pointshell) seconds += 11e-6 * points;
  return seconds;
}

bake::BakePlan predict(const Scene& scene, const SceneMesh& mesh, const PlannedAsset& asset,
                       const bake::BakeOptions& options) {
  try {
    return bake::plan_bake(mesh.mesh, options);
  } catch (const bake::BakeError& error) {
    if (scene.error.value == 0) throw SceneError(asset.place, error.what());
    refuse_wish(scene.error, fmt::format("an error of {} cannot be had with '{}': {}",
                                         bake::format_length(scene.error.value), mesh.file.string(), error.what()));
  }
}

// Lists the shapes and their assets, one for each mesh and set of options.
void list_assets(const Scene& scene, const std::vector<SceneMesh>& meshes, double resolution, ScenePlan& plan) {
  std::map<std::tuple<std::size_t, double, bake::Repair, double>, std::size_t> known;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    plan.first_shape.push_back(plan.shapes.size());
    for (std::size_t s = 0; s < scene.bodies[b].shapes.size(); ++s) {
      const SceneShape& shape = scene.bodies[b].shapes[s];
      PlannedShape planned{b, s};
      if (is_mesh(shape)) {
        const auto mesh = static_cast<std::size_t>(
            std::find_if(meshes.begin(), meshes.end(), [&](const SceneMesh& m) { return m.is_of(shape); }) -
            meshes.begin());
        const auto [it, is_new] =
            known.emplace(std::tuple(mesh, shape.voxel_size, shape.repair, shape.sheet_thickness), plan.assets.size());
        planned.asset = it->second;
        if (is_new) {
          PlannedAsset asset;
          asset.mesh = mesh;
          asset.place = shape.place;
          asset.options.repair = shape.repair;
          asset.options.sheet_thickness = shape.sheet_thickness;
          choose_grid(scene, shape, meshes[mesh].longest(), resolution, asset.options);
          plan.assets.push_back(std::move(asset));
        }
      }
      plan.shapes.push_back(planned);
    }
  }
  plan.first_shape.push_back(plan.shapes.size());
}

// The slowest pairs, as many as can touch at once.
double estimate_step(ScenePlan& plan) {
  // Smallest first. Of more pairs than all bodies can have at once, only the slowest are kept.
  std::priority_queue<double, std::vector<double>, std::greater<>> pairs;
  const std::size_t bodies_of_scene = plan.first_shape.size() - 1;
  const std::size_t most = kNeighbours * bodies_of_scene / 2;
  std::vector<bool> touches(bodies_of_scene, false);
  for_each_pair(plan, [&](const PlannedShape& a, const PlannedShape& b) {
    const bool first = a.asset != PlannedShape::kNone;
    const bool second = b.asset != PlannedShape::kNone;
    if (!first && !second) return;
    const bool shell_is_first = !second || (first && gives_pointshell(side_of(plan, a), side_of(plan, b)));
    const double root = std::sqrt(static_cast<double>(side_of(plan, shell_is_first ? a : b).points));
    pairs.push(first && second ? kPair + kPairPerRootPoint * root : kPrimitive + kPrimitivePerRootPoint * root);
    if (pairs.size() > most) pairs.pop();
    touches[a.body] = touches[b.body] = true;
  });
  const auto bodies = static_cast<std::size_t>(std::count(touches.begin(), touches.end(), true));
  while (pairs.size() > kNeighbours * bodies / 2) pairs.pop();
  double sum = 0;
  for (; !pairs.empty(); pairs.pop()) sum += pairs.top();
  return sum;
}

ScenePlan plan_at(const Scene& scene, const std::vector<SceneMesh>& meshes, const Meeting& meeting, double resolution) {
  ScenePlan plan;
  plan.meeting = meeting;
  list_assets(scene, meshes, resolution, plan);
  for (std::size_t i = 0; i < plan.assets.size(); ++i) {
    PlannedAsset& asset = plan.assets[i];
    choose_bands(scene, plan, i, asset.options);
    asset.ordinary = asset.everything = asset.options;
    asset.everything.layers = asset.everything.real = true;
    asset.predicted_everything = predict(scene, meshes[asset.mesh], asset, asset.everything);
    asset.predicted_ordinary = predict(scene, meshes[asset.mesh], asset, asset.ordinary);
  }
  choose_parts(scene, plan);
  for (PlannedAsset& asset : plan.assets) asset.options.voxelmap = asset.options.pointshell = false;
  for (PlannedShape& shape : plan.shapes) {
    if (shape.asset == PlannedShape::kNone) continue;
    bake::BakeOptions& options = plan.assets[shape.asset].options;
    // The distances of a pointshell's body place its contacts between the points.
    options.voxelmap = options.voxelmap || overlap(shape.parts, Use::everything);
    options.pointshell = options.pointshell || overlap(shape.parts, Use::pointshell);
    if (overlap(shape.parts, Use::pointshell)) {
      shape.segments = scene.bodies[shape.body].segments.value_or(scene.step > kLongStep ? kSegments : 0);
    }
  }
  std::size_t needed = 0;
  for (PlannedAsset& asset : plan.assets) {
    const std::size_t triangles = meshes[asset.mesh].mesh.triangles.size();
    asset.seconds_everything = predict_seconds(asset.predicted_everything, asset.everything, triangles);
    asset.seconds_ordinary = predict_seconds(asset.predicted_everything, asset.ordinary, triangles);
    asset.seconds = predict_seconds(asset.predicted_everything, asset.options, triangles);
    if (!asset.is_needed()) continue;
    if (++needed > scene_manifest::kMostAssets)
      throw SceneError(asset.place, fmt::format("a scene has at most {} assets", scene_manifest::kMostAssets));
    asset.predicted = predict(scene, meshes[asset.mesh], asset, asset.options);
    plan.bytes += asset.predicted.predicted_asset_bytes;
  }
  plan.seconds_per_step = estimate_step(plan);
  return plan;
}

}  // namespace

ScenePlan plan_scene(const Scene& scene, const std::vector<SceneMesh>& meshes) {
  bool is_free = scene.error.value == 0;  // whether the plan may choose coarser voxels
  if (is_free) {
    is_free = false;
    for (const SceneBody& body : scene.bodies) {
      for (const SceneShape& shape : body.shapes) is_free = is_free || (is_mesh(shape) && shape.voxel_size == 0);
    }
  }
  const Meeting meeting(scene);
  constexpr double kCoarser = 1.25;
  for (double resolution = kUsualResolution;; resolution = std::max(kLeastResolution, resolution / kCoarser)) {
    ScenePlan plan = plan_at(scene, meshes, meeting, resolution);
    const bool fits_memory = scene.memory.value == 0 || static_cast<double>(plan.bytes) <= scene.memory.value;
    const bool fits_time = scene.time.value == 0 || plan.seconds_per_step <= scene.time.value;
    if (fits_memory && fits_time) return plan;
    if (is_free && resolution > kLeastResolution) continue;
    const std::string why =
        scene.error.value > 0
            ? fmt::format("with the error of {} that is wished", bake::format_length(scene.error.value))
            : (is_free ? fmt::format("with {} voxels along each body, the fewest that are sensible", kLeastResolution)
                       : "with the voxels that are stated");
    if (!fits_memory) {
      const auto [needed, wished] = bake::differing_bytes(static_cast<double>(plan.bytes), scene.memory.value);
      refuse_wish(scene.memory,
                  fmt::format("the assets would take {} of memory (predicted, from above) {}, more than "
                              "the {} wished; wish more memory{}",
                              needed, why, wished, is_free ? " or leave bodies out" : " or coarser voxels"));
    }
    const auto [needed, wished] = differing_numbers(1e6 * plan.seconds_per_step, 1e6 * scene.time.value, 3);
    refuse_wish(scene.time, fmt::format("contacts would take {} us a step (estimated) {}, more than the {} us "
                                        "wished; wish more time or keep bodies apart by their masks",
                                        needed, why, wished));
  }
}

std::string asset_file(const SceneMesh& mesh, const bake::BakeOptions& options) {
  bake::BakeSettings settings;
  settings.options = options;
  constexpr std::size_t kLongest = 100;  // file systems limit names
  std::string stem = mesh.file.stem().string();
  if (stem.size() > kLongest) {
    std::size_t end = kLongest;
    while (end > 0 && (stem[end] & 0xC0) == 0x80) --end;  // does not cut a UTF-8 character
    stem.resize(end);
  }
  return fmt::format("{}-{}.vps.hdf", stem,
                     bake::cache_key(bake::bake_record(mesh.mesh, settings)).digits.substr(0, 8));
}

void refine(PlannedAsset& asset, double by) {
  asset.options.voxel_size /= by;
  asset.ordinary.voxel_size = asset.everything.voxel_size = asset.options.voxel_size;
}

}  // namespace vps::cli

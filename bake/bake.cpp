// SPDX-License-Identifier: GPL-3.0-or-later
// The bake as a list of its stages. Paper: Sec. 2.1.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstring>

#include "bake/extent.h"
#include "bake/plan.h"
#include "bake/repair/check.h"
#include "bake/stages/bounding_spheres.h"
#include "bake/stages/certify.h"
#include "bake/stages/cluster_points.h"
#include "bake/stages/coarse_layers.h"
#include "bake/stages/far_field.h"
#include "bake/stages/find_hulls.h"
#include "bake/stages/fit_planes.h"
#include "bake/stages/mass_properties.h"
#include "bake/stages/pack_sections.h"
#include "bake/stages/sample_pointshell.h"
#include "bake/stages/wall_thickness.h"
#include "bake/vps_bake.h"
#include "version.h"

namespace vps::bake {
namespace {

// Reports the start of each stage and records its duration when the next one starts.
class Stages {
 public:
  Stages(const BakeOptions& options, std::vector<StageTime>& times, double total)
      : options_(options), times_(times), total_(total) {}
  void start(const char* stage) {
    stop();
    if (options_.progress) options_.progress(stage, done_++ / total_);
    times_.push_back({stage, 0});
    begin_ = std::chrono::steady_clock::now();
  }
  void stop() {
    if (times_.empty()) return;
    if (times_.back().seconds == 0) {
      times_.back().seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    }
  }

 private:
  const BakeOptions& options_;
  std::vector<StageTime>& times_;
  const double total_;
  double done_ = 0;
  std::chrono::steady_clock::time_point begin_;
};

void describe_mesh(const Surface& surface, AssetInfo& info) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    info.bounds_min[axis] = surface.bounds_min[static_cast<Eigen::Index>(axis)];
    info.bounds_max[axis] = surface.bounds_max[static_cast<Eigen::Index>(axis)];
  }
  info.triangles = surface.triangles.size();
  info.vertices = surface.vertices.size();
  info.surface_area = surface.area;
  static_assert(sizeof(Vector) == 3 * sizeof(double));
  const std::uint64_t parts[2] = {hash_bytes(std::as_bytes(std::span(surface.vertices))),
                                  hash_bytes(std::as_bytes(std::span(surface.triangles)))};
  info.mesh_hash = hash_bytes(std::as_bytes(std::span(parts)));
  const MassProperties mass = mass_properties(surface);
  info.volume = mass.volume;
  const Eigen::Matrix3d& inertia = mass.inertia;
  info.inertia = {inertia(0, 0), inertia(1, 1), inertia(2, 2), inertia(0, 1), inertia(0, 2), inertia(1, 2)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    info.centre_of_mass[axis] = mass.centre_of_mass[static_cast<Eigen::Index>(axis)];
  }
  const std::string generator = "vpsbake " VPSBAKE_VERSION;
  std::memcpy(info.generator.data(), generator.data(), std::min(generator.size(), info.generator.size() - 1));
}

void warn_of_thin_walls(const ThinWalls& thin, double voxel_size, std::vector<std::string>& notes) {
  // No warning below this share: the tips of acute edges are thin on every mesh.
  constexpr double kWorthSaying = 0.001;
  if (thin.share < kWorthSaying) return;
  notes.push_back(fmt::format(
      "{:.1f} % of the surface has a wall thinner than two voxels under it, the thinnest found {:.3g} voxels at "
      "({:.6g}, {:.6g}, {:.6g}) m; bodies may pass through it",
      100 * thin.share, thin.thinnest / voxel_size, thin.place.x(), thin.place.y(), thin.place.z()));
}

}  // namespace

const char* describe(Repair repair) {
  switch (repair) {
    case Repair::none:
      return "none";
    case Repair::weld:
      return "weld";
    case Repair::stitch:
      return "stitch";
    case Repair::fill:
      return "fill";
    case Repair::wrap:
      return "wrap";
    case Repair::automatic:
      break;
  }
  return "automatic";
}

BakePlan plan_bake(const TriangleMesh& mesh, const BakeOptions& options) {
  Extent extent = measure_extent(mesh);
  extent.creases = measure_creases(mesh);
  return plan_grid(extent, options).plan;
}

ClosedMesh closed_mesh(const TriangleMesh& mesh, const BakeOptions& options) {
  const double voxel_size = plan_bake(mesh, options).voxel_size;
  RepairOutcome outcome;
  const Surface surface = check_mesh(mesh, {options.repair, voxel_size, options.sheet_thickness}, outcome);
  ClosedMesh out{{{}, surface.triangles}, outcome.used, outcome.filled_share, std::move(outcome.notes)};
  for (const Vector& v : surface.vertices) out.mesh.vertices.push_back({v.x(), v.y(), v.z()});
  return out;
}

BakedAsset bake(const TriangleMesh& mesh, const BakeOptions& asked) {
  BakedAsset asset;
  Stages stages(asked, asset.times, 5 + (asked.voxelmap ? 5 : 0) + (asked.pointshell ? 3 : 0));

  stages.start("check");
  BakeOptions options = asked;
  options.voxel_size = plan_bake(mesh, asked).voxel_size;  // a skin or thickness must not change it
  RepairOutcome outcome;
  const Surface surface = check_mesh(mesh, {options.repair, options.voxel_size, options.sheet_thickness}, outcome);
  asset.repair = outcome.used;
  asset.filled_share = outcome.filled_share;
  asset.notes = std::move(outcome.notes);
  const GridPlan planned = plan_grid(extent_of(surface), options);
  const Grid& grid = planned.grid;
  describe_mesh(surface, asset.info);

  stages.start("voxelize");
  const SurfaceVoxels voxels = voxelize(surface, grid);
  stages.start("fill_layers");
  const InsideRuns runs = fill_inside(surface, grid);
  stages.start("distance_field");
  // One voxel wider than the band, because cells at the band's end have corners beyond it.
  const BandField field = distance_field(surface, grid, runs, (options.band_inside + 1) * grid.voxel_size,
                                         (options.band_outside + 1) * grid.voxel_size);
  asset.info.voxel_size = grid.voxel_size;
  stages.start("thin_walls");
  const ClosestPoint closest(surface);
  constexpr std::size_t kWallSamples = 20000;
  warn_of_thin_walls(find_thin_walls(surface, closest, grid, runs, field, spread_points(surface, kWallSamples)),
                     grid.voxel_size, asset.notes);

  if (options.voxelmap) {
    stages.start("coarse_layers");
    const std::vector<std::int16_t> coarse = coarse_layers(grid, voxels, runs);
    stages.start("sample_field");
    const InsideTest inside(surface, grid);
    const Representations fields = represent(surface, grid, voxels, runs, field, inside, options, planned.lambda);
    describe_voxelmap(grid, voxels, runs, options, planned.lambda, asset.info);
    stages.start("certify");
    const TriangleTree tree(surface, kFarReach_vx * grid.voxel_size);
    const Distances distances{closest, tree, tree.error() + 1e-5 * grid.voxel_size};
    certify_fields(surface, distances, inside, grid, field, fields, options, asset.info);
    pack_voxelmap(grid, field, coarse, fields, asset.sections);
    stages.start("far_field");
    const double least = (std::min(options.band_inside, options.band_outside) - std::sqrt(0.75)) * grid.voxel_size;
    pack_far(far_field({surface, distances, inside, grid, coarse}, least, voxels.count), asset.info, asset.sections);
    if (options.scaled) {
      stages.start("fit_planes");
      pack_planes(grid,
                  fit_planes({surface, grid, fields, coarse, asset.info.band_inner, asset.info.band_outer,
                              asset.info.scaled_error.bound}),
                  asset.sections);
    }
  }
  if (options.pointshell) {
    stages.start("sample_pointshell");
    const Pointshell shell =
        sample_pointshell(surface, grid, voxels, runs, field, options.alpha * grid.voxel_size, options.thin_faces);
    stages.start("cluster_points");
    const PointTree tree = cluster_points(shell.positions, shell.faces, surface.area, options.branching);
    stages.start("bounding_spheres");
    describe_pointshell(shell, tree, options.branching, asset.info);
    const std::vector<Point3f> points = tree_points(shell, tree, asset.info);
    pack_pointshell(shell, tree, bounding_spheres(tree, points), asset.info, asset.sections);
    pack_hulls(find_hulls(tree, points, kHullTolerance * shell.feature_covering_radius), asset.sections);
  }
  stages.stop();
  if (options.progress) options.progress("done", 1);
  return asset;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
// The bake as a list of its stages. Paper: Sec. 2.1.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <optional>

#include "bake/extent.h"
#include "bake/plan.h"
#include "bake/quantity_text.h"
#include "bake/repair/check.h"
#include "bake/stage_graph.h"
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

template <class Bounded>
double longest_side(const Bounded& mesh) {
  return (mesh.bounds_max - mesh.bounds_min).maxCoeff();
}

Extent extent_of(const TriangleMesh& mesh) {
  Extent extent = measure_extent(mesh);
  extent.creases = measure_creases(mesh);
  return extent;
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
  return plan_grid(extent_of(mesh), options).plan;
}

ClosedMesh closed_mesh(const TriangleMesh& mesh, const BakeOptions& options) {
  const double voxel_size = plan_bake(mesh, options).voxel_size;
  RepairOutcome outcome;
  const Surface surface =
      check_mesh(mesh, {options.repair, voxel_size, options.sheet_thickness, report_steps(options)}, outcome);
  ClosedMesh out{{{}, surface.triangles}, outcome.used, outcome.filled_share, std::move(outcome.notes)};
  for (const Vector& v : surface.vertices) out.mesh.vertices.push_back({v.x(), v.y(), v.z()});
  return out;
}

BakedAsset bake(const TriangleMesh& mesh, const BakeOptions& asked) {
  BakedAsset asset;
  BakeOptions options = asked;
  Surface surface;
  GridPlan planned;
  const Extent extent = extent_of(mesh);
  const GridPlan before = plan_grid(extent, asked);
  if (asked.planned) asked.planned(before.plan);
  const Grid& grid = planned.grid;
  StageGraph stages(options.progress);

  const auto expect_times = [&](const GridPlan& plan) {
    stages.expect([&](const char* stage) { return expected_seconds(stage, plan.size); });
  };

  const auto check = stages.add("check", {}, [&] {
    options.voxel_size = before.grid.voxel_size;  // a skin or thickness must not change it
    RepairOutcome outcome;
    const auto repair = [&] {
      outcome = {};
      surface = check_mesh(mesh, {options.repair, options.voxel_size, options.sheet_thickness, report_steps(options)},
                           outcome);
    };
    repair();
    const double kept = longest_side(surface);
    if (asked.voxel_size == 0 && kept < 0.99 * longest_side(extent)) {
      options.voxel_size = kept / asked.resolution;
      repair();
      outcome.notes.push_back(fmt::format("without what was left out the mesh is {} long, not {}; voxels are {}",
                                          format_length(kept), format_length(longest_side(extent)),
                                          format_length(options.voxel_size)));
    }
    asset.repair = outcome.used;
    asset.filled_share = outcome.filled_share;
    asset.notes = std::move(outcome.notes);
    const bool is_changed = asset.repair != Repair::none || surface.triangles.size() != mesh.triangles.size();
    planned = plan_grid(extent_of(surface, is_changed ? measure_creases(surface) : extent.creases), options);
    expect_times(planned);
    asset.info.voxel_size = grid.voxel_size;
  });
  std::vector<Corner> corners;
  const auto described = stages.add("describe", {check}, [&] {
    describe_mesh(surface, asset.info);
    corners = find_corners(surface, grid.voxel_size);
  });

  SurfaceVoxels voxels;
  const auto voxelized = stages.add("voxelize", {check}, [&] { voxels = voxelize(surface, grid); });
  InsideRuns runs;
  const auto filled = stages.add("fill_layers", {check}, [&] { runs = fill_inside(surface, grid); });
  BandField field;
  const auto measured = stages.add("distance_field", {filled}, [&] {
    // One voxel wider than the band, because cells at the band's end have corners beyond it.
    field = distance_field(surface, grid, runs, (options.band_inside + 1) * grid.voxel_size,
                           (options.band_outside + 1) * grid.voxel_size);
  });

  std::vector<std::int16_t> coarse, blocks;  // of bricks, and of the blocks that the asset has
  std::optional<InsideTest> inside;
  std::optional<TriangleTree> tree;
  const auto distances = [&] { return Distances{surface, *tree, tree->error() + 1e-5 * grid.voxel_size}; };
  Representations fields;
  FarField far;
  FieldPlanes planes;
  auto last_of_map = measured, fielded = measured, sampled = measured;
  if (options.voxelmap) {
    const auto layered = stages.add("coarse_layers", {voxelized, filled}, [&] {
      coarse = coarse_layers(grid, voxels, runs, kBrickEdge);
      blocks = coarse_layers(grid, voxels, runs, kCoarseEdge);
    });
    const auto sided = stages.add("inside_test", {check}, [&] { inside.emplace(surface, grid); });
    fielded = stages.add("sample_field", {voxelized, measured, sided}, [&] {
      fields = represent(surface, grid, voxels, runs, field, *inside, options, planned.lambda,
                         [&](double done) { stages.advance(fielded, done); });
      describe_voxelmap(grid, voxels, runs, options, planned.lambda, asset.info);
    });
    const auto treed =
        stages.add("triangle_tree", {fielded}, [&] { tree.emplace(surface, kFarReach_vx * grid.voxel_size); });
    const auto walls_found = stages.add("thin_walls", {treed}, [&] {
      const std::size_t places = enough_places(voxels.count, 4, 20000);
      warn_of_thin_walls(find_thin_walls(surface, *tree, grid, runs, field, spread_points(surface, places)),
                         grid.voxel_size, asset.notes);
    });
    const auto certified = stages.add("certify", {fielded, treed}, [&] {
      certify_fields(surface, distances(), *inside, grid, field, fields, options, asset.info);
    });
    const auto packed = stages.add("pack_voxelmap", {fielded, layered}, [&] {
      pack_voxelmap(grid, field, {coarse, blocks}, fields, asset.sections);
    });
    const auto far_sampled = stages.add("far_field", {voxelized, layered, sided, treed}, [&] {
      const double least = (std::min(options.band_inside, options.band_outside) - std::sqrt(0.75)) * grid.voxel_size;
      far = far_field({surface, distances(), *inside, grid, coarse}, least, voxels.count);
    });
    last_of_map = stages.add("free_searches", {certified, packed, far_sampled, walls_found}, [&] {
      inside.reset();
      tree.reset();
      // fit_planes needs the scaled field.
      fields.layers = {};
      fields.tree.penetration = {};
      fields.tree.gradient = {};
      // The pointshell needs values only.
      UnsetVector<std::uint32_t>().swap(field.closest);
      std::vector<std::size_t>().swap(field.near_start);
      std::vector<std::uint32_t>().swap(field.near_triangles);
    });
  }

  Pointshell shell;
  PointTree point_tree;
  std::vector<SectionData> shell_sections;
  auto last_in_parallel = last_of_map;
  if (options.pointshell) {
    // Side by side with the samples of the field, or with the trees, it would raise the peak of memory.
    sampled = last_in_parallel = stages.add("sample_pointshell", {voxelized, described, last_of_map}, [&] {
      shell = sample_pointshell(surface, corners, grid, voxels, runs, field, options.alpha * grid.voxel_size,
                                options.thin_faces, [&](double done) { stages.advance(sampled, done); });
      // No later stage needs these.
      field = {};
      voxels = {};
      runs = {};
    });
    const auto clustered = stages.add("cluster_points", {sampled}, [&] {
      point_tree = cluster_points(shell.positions, shell.faces, surface.area, options.branching);
    });
    stages.add("bounding_spheres", {clustered, described}, [&] {
      describe_pointshell(shell, point_tree, options.branching, asset.info);
      const std::vector<Point3f> points = tree_points(shell, point_tree, asset.info);
      pack_pointshell(shell, point_tree,
                      bounding_spheres(point_tree, points, {asset.info.position_origin, asset.info.position_step}),
                      asset.info, shell_sections);
      pack_hulls(find_hulls(point_tree, points, kHullTolerance * shell.feature_covering_radius), shell_sections);
    });
  }
  if (options.voxelmap && options.scaled) {
    // Beside the clusters, which only one thread makes.
    stages.add("fit_planes", {last_in_parallel}, [&] {
      planes = fit_planes(
          {surface, grid, fields, coarse, asset.info.band_inner, asset.info.band_outer, asset.info.scaled_error.bound});
    });
  }

  expect_times(before);
  stages.run();
  asset.times = stages.times();
  if (options.voxelmap) pack_far(far, asset.info, asset.sections);
  if (options.voxelmap && options.scaled) pack_planes(planes, asset.sections);
  if (options.voxelmap) pack_corners(std::move(corners), asset.sections);
  std::move(shell_sections.begin(), shell_sections.end(), std::back_inserter(asset.sections));
  return asset;
}

}  // namespace vps::bake

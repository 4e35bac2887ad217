// SPDX-License-Identifier: GPL-3.0-or-later
// Plans the grid and predicts the memory before baking starts. A wrong unit is the usual cause of an absurd grid, so
// the messages ask for the unit.
#include "bake/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/quantity_text.h"
#include "bake/stages/mass_properties.h"

namespace vps::bake {
namespace {

[[noreturn]] void refuse_plan(const std::string& message) {
  throw BakeError("plan", message);
}

std::string size_of(const Extent& mesh) {
  const Vector size = mesh.bounds_max - mesh.bounds_min;
  return fmt::format("{} x {} x {}", format_length(size.x()), format_length(size.y()), format_length(size.z()));
}

double choose_voxel_size(const Extent& mesh, const BakeOptions& options) {
  const double longest = (mesh.bounds_max - mesh.bounds_min).maxCoeff();
  if (!(longest > 0)) refuse_plan("all vertices of the mesh are one point; check the export");
  const double s = options.voxel_size > 0 ? options.voxel_size : longest / options.resolution;
  if (!(std::isfinite(s) && s > 0)) refuse_plan("no voxel size; give --voxel or --resolution");
  if (s > longest) {
    refuse_plan(fmt::format("a voxel of {} is larger than the mesh, which is {}; is the mesh's unit right? (--unit)",
                            format_length(s), size_of(mesh)));
  }
  return s;
}

// Queries run in float in the asset's own frame. A voxel at the farthest point must still be 64 float steps wide.
void check_float_range(const Extent& mesh, double s) {
  const double farthest = std::max(mesh.bounds_min.cwiseAbs().maxCoeff(), mesh.bounds_max.cwiseAbs().maxCoeff());
  constexpr double kFloatStep = 1.2e-7;
  if (farthest * kFloatStep > s / 64) {
    refuse_plan(
        fmt::format("the mesh reaches {} from its origin, too far for voxels of {} in single precision; move it near "
                    "the origin or choose larger voxels",
                    format_length(farthest), format_length(s)));
  }
  if (s < 1e-15 || farthest > 1e12)
    refuse_plan("the mesh is outside the range of sizes that floats hold; is the unit right? (--unit)");
}

// Upper estimate of the number of field bricks. Flat faces have one for each brick of the band. Creases, and the
// middles of walls that the band fills, have field bricks down to cells of a quarter voxel. The estimate is 1 to 3
// times the real number for 42 bakes (28 closed meshes of a corpus at 200 voxels, the bunny up to 1024, ten more after
// `fill`). It is closest where creases lie a few voxels apart everywhere. Areas and lengths here are in voxels.
double predict_field_bricks(const Extent& mesh, double s, const BakeOptions& options) {
  const double area = mesh.area / (s * s);
  // For a plate this is its thickness.
  const double wall = mesh.area > 0 ? 2 * mesh.volume / mesh.area / s : 0;
  const double filled_by_band = 2 * (options.band_inside + 1);
  const double thin = std::clamp((filled_by_band - wall) / 3, 0.0, 1.0);
  const double at_defaults = area * (0.1 + 0.35 * thin) + (1.1 * mesh.creases.blunt + 6.5 * mesh.creases.sharp) / s;
  const BakeOptions defaults;
  const double wider = (options.band_inside + options.band_outside) / (defaults.band_inside + defaults.band_outside);
  const double finer = std::max(1.0, defaults.field_error / options.field_error);
  return at_defaults * std::max(1.0, wider) * finer;
}

// Number of bricks of 8x8x8 voxels that hold distances.
double predict_bricks(const Extent& mesh, const Grid& grid, const BakeOptions& options) {
  const double edge = kBrickEdge * grid.voxel_size;
  // A plane of random direction cuts on average 3/2 bricks per area of a brick's face.
  const double band = 1.5 * 7 / kBrickEdge + (options.band_inside + options.band_outside + 2) / kBrickEdge;
  return std::min(static_cast<double>(grid.brick_count()), mesh.area / (edge * edge) * band + 27);
}

double limit_field_bricks(const Extent& mesh, const Grid& grid, const BakeOptions& options) {
  if (!options.voxelmap || !(options.scaled || options.real)) return 0;
  const double most = predict_bricks(mesh, grid, options) * 64;  // a bevel gear has 60 per brick
  return std::min(predict_field_bricks(mesh, grid.voxel_size, options), most);
}

// Sums the predicted sizes of the sections in docs/internals/format.md.
std::size_t predict_asset(const Extent& mesh, const GridPlan& planned, const BakeOptions& options) {
  constexpr double kHeader = 20e3;  // user block and HDF5's own metadata
  const Grid& grid = planned.grid;
  double bytes = kHeader;
  if (options.voxelmap) {
    const double scaled = scaled_limit(options, grid.voxel_size, planned.lambda) <= 127 ? 1 : 2;
    const double sample = (options.scaled ? scaled : 0) + (options.real ? 8 + 3 * 4 : 0);
    constexpr double kNode = 8;  // one octree node of eight entries for four bricks
    bytes += limit_field_bricks(mesh, grid, options) * (kFieldSamples * sample + kNode);
    const auto grid_bricks = static_cast<double>(grid.brick_count());
    const double bricks = predict_bricks(mesh, grid, options);
    bytes += 6 * grid_bricks / 8;   // a coarse layer and a root for each block of eight bricks
    constexpr double kPlanes = 10;  // of 0.3 blocks beside each brick of the band
    if (options.scaled) bytes += kPlanes * bricks;
    if (options.layers) bytes += 4 * grid_bricks + bricks * kBrickVoxels;
  }
  // A plane has 1 to 1.73 surface voxels for each square of a voxel's size.
  if (options.voxelmap) bytes += kFarNodes * 1.73 * mesh.area / (grid.voxel_size * grid.voxel_size);
  return static_cast<std::size_t>(bytes + kPointBytes * static_cast<double>(planned.plan.predicted_points));
}

// Upper estimate of the peak of resident bytes: docs/internals/benchmarks/scale.md, "Memory before a bake". It leaves
// out the exact arithmetic that unites crossing shells, which took up to 400 MB.
std::size_t predict_memory(const Extent& mesh, const Grid& grid, const BakeOptions& options) {
  const double area = mesh.area / (grid.voxel_size * grid.voxel_size);
  const auto grid_bricks = static_cast<double>(grid.brick_count());
  const double bricks = predict_bricks(mesh, grid, options);
  const double field_bricks = limit_field_bricks(mesh, grid, options);

  // Held during the whole bake: the program, the mesh with its tree, distances and triangles of the band's voxels,
  // masks of bricks, an index of bricks for each sparse set, scanlines and lists of triangles.
  constexpr double kProgram = 38e6;
  const double band_voxels =
      std::min(bricks * kBrickVoxels, 1.2 * (options.band_inside + options.band_outside + 2) * area);
  const double held = kProgram + 400 * static_cast<double>(mesh.triangles) +
                      band_voxels * (sizeof(double) + sizeof(std::uint32_t)) +
                      bricks * (300 + (options.layers ? 2 * kBrickVoxels : 0)) + 14 * grid_bricks + 20 * area;
  // Held by one stage at a time. sample_field: samples as integers and packed. The pointshell's stages: points, blocks
  // of the surface, clusters.
  const double field = field_bricks * (1000 + (options.real ? 6500 : 0));
  const double shell = options.pointshell ? 350 * 0.81 * area / (options.alpha * options.alpha) : 0;
  return static_cast<std::size_t>(held + std::max(field, shell));
}

}  // namespace

Extent measure_extent(const TriangleMesh& mesh) {
  const auto refuse_mesh = [](const std::string& message) { throw BakeError("check", message); };
  Extent extent;
  const double infinity = std::numeric_limits<double>::infinity();
  extent.bounds_min = Vector::Constant(infinity);
  extent.bounds_max = Vector::Constant(-infinity);
  extent.triangles = mesh.triangles.size();
  double volume6 = 0;
  if (mesh.triangles.empty()) refuse_mesh("the mesh has no triangles; check the export");
  for (const auto& triangle : mesh.triangles) {
    Vector corners[3];
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle[k] >= mesh.vertices.size())
        refuse_mesh("a triangle refers to a vertex that is not there; export it again");
      const std::array<double, 3>& p = mesh.vertices[triangle[k]];
      corners[k] = Vector(p[0], p[1], p[2]);
      if (!corners[k].allFinite())
        refuse_mesh(fmt::format("vertex {} is not finite; export the mesh again", triangle[k]));
      extent.bounds_min = extent.bounds_min.cwiseMin(corners[k]);
      extent.bounds_max = extent.bounds_max.cwiseMax(corners[k]);
    }
    const Vector normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    extent.area += normal.norm() / 2;
    const std::array<double, 3>& from = mesh.vertices[mesh.triangles.front()[0]];
    volume6 += (corners[0] - Vector(from[0], from[1], from[2])).dot(normal);
  }
  extent.volume = std::abs(volume6) / 6;
  return extent;
}

Extent extent_of(const Surface& surface, const Creases& creases) {
  const double volume = mass_properties(surface).volume;
  return {surface.bounds_min, surface.bounds_max, surface.area, volume, creases, surface.triangles.size()};
}

std::int32_t scaled_limit(const BakeOptions& options, double voxel_size, double lambda) {
  const double steps = std::max(options.band_inside, options.band_outside) * voxel_size / lambda;
  // The limit is the whole range of the integers, because samples beyond the band sharpen interpolation at its end.
  if (steps <= 127 * (1 + 1e-9)) return 127;
  return steps <= 32767 * (1 + 1e-9) ? 32767 : std::numeric_limits<std::int32_t>::max();
}

void check_options(const BakeOptions& o) {
  if (!o.voxelmap && !o.pointshell) refuse_plan("nothing to bake; choose voxelmap, pointshell or both");
  if (o.voxelmap && !o.layers && !o.scaled && !o.real)
    refuse_plan("a voxelmap needs a field; choose layers, scaled or real");
  if (o.precision != BakeOptions::kAutoPrecision && (o.precision < 0 || o.precision > 15)) {
    refuse_plan("the precision is out of range; choose 0 to 15");
  }
  if (o.branching < 2 || o.branching > 64) refuse_plan("the branching is out of range; choose 2 to 64");
  if (o.voxel_size == 0 && o.resolution > 8192) {
    refuse_plan("the resolution is out of range; choose 1 to 8192 voxels");
  }
  for (const double band : {o.band_inside, o.band_outside}) {
    if (!(band >= 2 && band <= 8)) refuse_plan("the band is out of range; choose 2 to 8 voxels");
  }
  if (!(o.field_error >= 0.01 && o.field_error <= 1))
    refuse_plan("the field error is out of range; choose 0.01 to 1 voxels");
  if (!(o.alpha >= 0.25 && o.alpha <= 64)) refuse_plan("alpha is out of range; choose 0.25 to 64");
  if (!(o.thin_faces >= 1 && o.thin_faces <= 4)) refuse_plan("thin-faces is out of range; choose 1 to 4");
  if (o.thin_faces > 1 && !(o.voxelmap && o.pointshell)) {
    refuse_plan("thin faces need both parts: other bodies' points are sought in the voxelmap; bake both");
  }
}

GridPlan plan_grid(const Extent& mesh, const BakeOptions& options) {
  check_options(options);
  const double s = choose_voxel_size(mesh, options);
  check_float_range(mesh, s);
  const Vector size = mesh.bounds_max - mesh.bounds_min;
  // One voxel beyond the band on each side, so that every voxel with an exact distance has all its neighbours.
  const double pad = std::ceil(options.band_outside) + 1;

  GridPlan result;
  Grid& grid = result.grid;
  grid.voxel_size = s;
  grid.origin = mesh.bounds_min - Vector::Constant(pad * s);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double bricks = std::ceil((size[static_cast<Eigen::Index>(axis)] / s + 2 * pad) / kBrickEdge);
    constexpr double kLimit = 16384.0 / kBrickEdge;
    if (bricks > kLimit) {
      refuse_plan(
          fmt::format("voxels of {} make a grid of more than 16384 along one axis for a mesh of {}; is the mesh's unit "
                      "right (--unit)? Otherwise choose larger voxels",
                      format_length(s), size_of(mesh)));
    }
    grid.brick_dims[axis] = static_cast<std::uint32_t>(bricks);
    grid.dims[axis] = grid.brick_dims[axis] * kBrickEdge;
  }
  result.precision = options.precision;
  if (options.precision != BakeOptions::kAutoPrecision) {
    result.lambda = std::pow(10.0, -options.precision);
  } else {
    // The band fills the range of the narrowest integer type that gives steps of s/50 or finer.
    const double band = std::max(options.band_inside, options.band_outside) * s;
    result.lambda = band / 127 <= s / 50 ? band / 127 : band / 32767;
  }
  const double step = result.lambda;
  if (options.voxelmap && options.scaled && (step > s / 2 || scaled_limit(options, s, step) > 32767)) {
    refuse_plan(
        fmt::format("a precision of {} stores steps of {} for voxels of {}; choose steps between half a voxel and what "
                    "16 bits hold of the band, or leave --precision out",
                    result.precision, format_length(step), format_length(s)));
  }
  BakePlan& plan = result.plan;
  plan.voxel_size = s;
  plan.dims = grid.dims;
  plan.voxels = std::uint64_t{grid.dims[0]} * grid.dims[1] * grid.dims[2];
  const double spacing = options.alpha * s;
  // Random sequential packing of discs reaches 0.7 of the densest packing.
  plan.predicted_points =
      options.pointshell ? static_cast<std::uint64_t>(0.81 * mesh.area / (spacing * spacing)) + 1 : 0;
  result.size = {static_cast<double>(mesh.triangles), mesh.area / (s * s), limit_field_bricks(mesh, grid, options),
                 static_cast<double>(plan.predicted_points)};
  plan.predicted_memory_bytes = predict_memory(mesh, grid, options);
  plan.predicted_asset_bytes = predict_asset(mesh, result, options);
  if (plan.predicted_memory_bytes > options.memory_limit_bytes) {
    const auto [needed, limit] = differing_bytes(static_cast<double>(plan.predicted_memory_bytes),
                                                 static_cast<double>(options.memory_limit_bytes));
    refuse_plan(fmt::format(
        "a grid of {} x {} x {} voxels for a mesh of {} would need {} of memory, more than the limit of {}; "
        "is the mesh's unit right (--unit)? Otherwise choose larger voxels or a higher --memory",
        grid.dims[0], grid.dims[1], grid.dims[2], size_of(mesh), needed, limit));
  }
  return result;
}

}  // namespace vps::bake

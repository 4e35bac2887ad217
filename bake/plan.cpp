// SPDX-License-Identifier: GPL-3.0-or-later
// Grid and memory, known before baking starts. A wrong unit is the usual cause of an absurd grid: the message says so.
#include "bake/plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  throw BakeError("plan", message);
}

std::string size_of(const Extent& mesh) {
  const Vector size = mesh.bounds_max - mesh.bounds_min;
  return fmt::format("{} x {} x {}", format_length(size.x()), format_length(size.y()), format_length(size.z()));
}

void check_options(const BakeOptions& o) {
  if (!o.voxelmap && !o.pointshell) refuse("nothing to bake; choose voxelmap, pointshell or both");
  if (o.voxelmap && !o.layers && !o.scaled && !o.real)
    refuse("a voxelmap needs a field; choose layers, scaled or real");
  if (o.precision != BakeOptions::kAutoPrecision && (o.precision < 0 || o.precision > 15)) {
    refuse("the precision is out of range; choose 0 to 15");
  }
  if (o.branching < 2 || o.branching > 64) refuse("the branching is out of range; choose 2 to 64");
  if (o.voxel_size == 0 && o.resolution > 8192) {
    refuse("the resolution is out of range; choose 1 to 8192 voxels");
  }
  for (const double band : {o.band_inside, o.band_outside}) {
    if (!(band >= 2 && band <= 8)) refuse("the band is out of range; choose 2 to 8 voxels");
  }
  if (!(o.field_error >= 0.01 && o.field_error <= 1))
    refuse("the field error is out of range; choose 0.01 to 1 voxels");
  if (!(o.alpha >= 0.25 && o.alpha <= 64)) refuse("alpha is out of range; choose 0.25 to 64");
}

double choose_voxel_size(const Extent& mesh, const BakeOptions& options) {
  const double longest = (mesh.bounds_max - mesh.bounds_min).maxCoeff();
  const double s = options.voxel_size > 0 ? options.voxel_size : longest / options.resolution;
  if (!(std::isfinite(s) && s > 0)) refuse("no voxel size; give --voxel or --resolution");
  if (s > longest) {
    refuse(fmt::format("a voxel of {} is larger than the mesh, which is {}; is the mesh's unit right? (--unit)",
                       format_length(s), size_of(mesh)));
  }
  return s;
}

// Queries run in float in the asset's own frame: a voxel far from the origin must still be many float steps wide.
void check_float_range(const Extent& mesh, double s) {
  const double farthest = std::max(mesh.bounds_min.cwiseAbs().maxCoeff(), mesh.bounds_max.cwiseAbs().maxCoeff());
  constexpr double kFloatStep = 1.2e-7;
  if (farthest * kFloatStep > s / 64) {
    refuse(
        fmt::format("the mesh reaches {} from its origin, too far for voxels of {} in single precision; move it near "
                    "the origin or choose larger voxels",
                    format_length(farthest), format_length(s)));
  }
  if (s < 1e-15 || farthest > 1e12)
    refuse("the mesh is outside the range of sizes that floats hold; is the unit right? (--unit)");
}

// Bytes held at the peak: band bricks (distance and triangle number, again while they are compacted or else the stored
// fields three times over: computed, as sections, as a file), the brick grids, scanlines, and the mesh with CGAL's
// tree.
std::size_t predict_memory(const Extent& mesh, const Grid& grid, const BakeOptions& options) {
  const double s = grid.voxel_size;
  const double edge = kBrickEdge * s;
  const double bricks =
      std::min(static_cast<double>(grid.brick_count()),
               mesh.area / (edge * edge) * (1.7 + (options.band_inside + options.band_outside) / kBrickEdge) + 27);
  constexpr double kBandBytes = sizeof(double) + sizeof(std::uint32_t);
  const double layer_bytes = options.layers ? 4 : 0;
  const double brick_bytes =
      bricks * kBrickVoxels * (kBandBytes + std::max(kBandBytes + 2, options.voxelmap ? layer_bytes : 0));
  // Where creases are dense, most bricks of the band are divided twice over.
  constexpr double kFieldBricks = 12;
  constexpr double kSampleBytes = 2 * sizeof(double);  // of a block, and of the whole
  const double sample_bytes = kSampleBytes + (options.scaled ? 6 : 0) + (options.real ? 84 : 0);
  const double field =
      options.voxelmap && (options.scaled || options.real) ? bricks * kFieldBricks * kFieldStride * sample_bytes : 0;
  const double grids = static_cast<double>(grid.brick_count()) * 20;
  const double lines = static_cast<double>(grid.dims[1]) * grid.dims[2] * 16 + mesh.area / (s * s) * 40;
  const double points = mesh.area / (s * s) * 100;
  const double mesh_bytes = static_cast<double>(mesh.triangles) * 600;
  return static_cast<std::size_t>(brick_bytes + field + grids + lines + points + mesh_bytes);
}

}  // namespace

Extent measure_extent(const TriangleMesh& mesh) {
  const auto refuse_mesh = [](const std::string& message) { throw BakeError("check", message); };
  Extent extent;
  const double infinity = std::numeric_limits<double>::infinity();
  extent.bounds_min = Vector::Constant(infinity);
  extent.bounds_max = Vector::Constant(-infinity);
  extent.triangles = mesh.triangles.size();
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
    extent.area += (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm() / 2;
  }
  return extent;
}

std::string format_length(double metres) {
  const double size = std::abs(metres);
  if (size >= 1000) return fmt::format("{:.4g} km", metres / 1000);
  if (size >= 1 || size == 0) return fmt::format("{:.4g} m", metres);
  if (size >= 1e-3) return fmt::format("{:.4g} mm", metres * 1e3);
  return fmt::format("{:.4g} um", metres * 1e6);
}

std::string format_bytes(double bytes) {
  if (bytes >= 1e9) return fmt::format("{:.3g} GB", bytes / 1e9);
  if (bytes >= 1e6) return fmt::format("{:.3g} MB", bytes / 1e6);
  return fmt::format("{:.3g} kB", bytes / 1e3);
}

std::int32_t scaled_limit(const BakeOptions& options, double voxel_size, double lambda) {
  const double steps = std::max(options.band_inside, options.band_outside) * voxel_size / lambda;
  // All that the integers hold: samples beyond the band sharpen interpolation at its end.
  if (steps <= 127 * (1 + 1e-9)) return 127;
  return steps <= 32767 * (1 + 1e-9) ? 32767 : std::numeric_limits<std::int32_t>::max();
}

GridPlan plan_grid(const Extent& mesh, const BakeOptions& options) {
  check_options(options);
  const double s = choose_voxel_size(mesh, options);
  check_float_range(mesh, s);
  const Vector size = mesh.bounds_max - mesh.bounds_min;
  // One voxel beyond the band on each side: every exact voxel has all its neighbours.
  const double pad = std::ceil(options.band_outside) + 1;

  GridPlan result;
  Grid& grid = result.grid;
  grid.voxel_size = s;
  grid.origin = mesh.bounds_min - Vector::Constant(pad * s);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double bricks = std::ceil((size[static_cast<Eigen::Index>(axis)] / s + 2 * pad) / kBrickEdge);
    constexpr double kLimit = 16384.0 / kBrickEdge;
    if (bricks > kLimit) {
      refuse(
          fmt::format("voxels of {} make a grid of more than 16384 along one axis for a mesh of {}; is the mesh's unit "
                      "right? (--unit)",
                      format_length(s), size_of(mesh)));
    }
    grid.brick_dims[axis] = static_cast<std::uint32_t>(bricks);
    grid.dims[axis] = grid.brick_dims[axis] * kBrickEdge;
  }
  result.precision = options.precision;
  if (options.precision != BakeOptions::kAutoPrecision) {
    result.lambda = std::pow(10.0, -options.precision);
  } else {
    // The band fills the narrowest integers that give steps of s/50 or finer.
    const double band = std::max(options.band_inside, options.band_outside) * s;
    result.lambda = band / 127 <= s / 50 ? band / 127 : band / 32767;
  }
  const double step = result.lambda;
  if (options.voxelmap && options.scaled && (step > s / 2 || scaled_limit(options, s, step) > 32767)) {
    refuse(
        fmt::format("a precision of {} stores steps of {} for voxels of {}; choose steps between half a voxel and what "
                    "16 bits hold of the band, or leave --precision out",
                    result.precision, format_length(step), format_length(s)));
  }
  BakePlan& plan = result.plan;
  plan.voxel_size = s;
  plan.dims = grid.dims;
  plan.voxels = std::uint64_t{grid.dims[0]} * grid.dims[1] * grid.dims[2];
  const double spacing = options.alpha * s;
  // Random sequential packing of discs: 0.7 of the densest.
  plan.predicted_points =
      options.pointshell ? static_cast<std::uint64_t>(0.81 * mesh.area / (spacing * spacing)) + 1 : 0;
  plan.predicted_memory_bytes = predict_memory(mesh, grid, options);
  if (plan.predicted_memory_bytes > options.memory_limit_bytes) {
    refuse(fmt::format(
        "a grid of {} x {} x {} voxels for a mesh of {} would need {} of memory, more than the limit of {}; "
        "is the mesh's unit right (--unit)? Otherwise choose larger voxels",
        grid.dims[0], grid.dims[1], grid.dims[2], size_of(mesh),
        format_bytes(static_cast<double>(plan.predicted_memory_bytes)),
        format_bytes(static_cast<double>(options.memory_limit_bytes))));
  }
  return result;
}

}  // namespace vps

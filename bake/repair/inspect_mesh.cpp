// SPDX-License-Identifier: GPL-3.0-or-later
// The mesh check as a report. Nothing here changes what a bake does.
#include <algorithm>

#include "bake/extent.h"
#include "bake/repair/check.h"
#include "bake/repair/clean_mesh.h"
#include "bake/repair/self_intersections.h"
#include "bake/repair/topology.h"
#include "bake/stages/mass_properties.h"
#include "bake/stages/wall_thickness.h"
#include "bake/vps_bake.h"

namespace vps::bake {
namespace {

void count_edges(std::span<const EdgeUse> uses, MeshReport& report) {
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    report.open_edges += edge.size() == 1;
    report.nonmanifold_edges += edge.size() > 2;
    report.inconsistent_edges += edge.size() == 2 && edge[0].forward == edge[1].forward;
  });
}

// Two corners at a vertex are in one fan when their triangles share an edge there.
std::size_t count_nonmanifold_vertices(const Mesh& mesh, std::span<const EdgeUse> uses) {
  DisjointSets corners(3 * mesh.triangles.size());
  const auto corner = [&](std::uint32_t triangle, std::uint32_t vertex) {
    const Triangle& t = mesh.triangles[triangle];
    return 3 * triangle + (t[1] == vertex ? 1U : 0U) + (t[2] == vertex ? 2U : 0U);
  };
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    for (const EdgeUse& use : edge.subspan(1)) {
      corners.join(corner(edge[0].triangle, use.low()), corner(use.triangle, use.low()));
      corners.join(corner(edge[0].triangle, use.high()), corner(use.triangle, use.high()));
    }
  });
  std::vector<std::uint32_t> fans(mesh.vertices.size(), 0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::uint32_t k = 0; k < 3; ++k) fans[mesh.triangles[t][k]] += corners.find(3 * t + k) == 3 * t + k;
  }
  return static_cast<std::size_t>(std::count_if(fans.begin(), fans.end(), [](std::uint32_t n) { return n > 1; }));
}

void measure_walls(const Surface& surface, double voxel_size, MeshReport& report) {
  constexpr std::size_t kSamples = 20000;
  const std::vector<SurfacePoint> points = spread_points(surface, kSamples);
  std::vector<double> thickness = wall_thickness(surface, points);
  const auto thin = std::count_if(thickness.begin(), thickness.end(), [&](double t) { return t < 2 * voxel_size; });
  report.thin_share = static_cast<double>(thin) / kSamples;
  std::sort(thickness.begin(), thickness.end());
  report.wall_median = thickness[kSamples / 2];
  report.wall_p01 = thickness[kSamples / 100];
}

}  // namespace

MeshReport inspect_mesh(const TriangleMesh& input, const BakeOptions& options) {
  MeshReport report;
  const Extent extent = measure_extent(input);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    report.bounds_min[axis] = extent.bounds_min[static_cast<Eigen::Index>(axis)];
    report.bounds_max[axis] = extent.bounds_max[static_cast<Eigen::Index>(axis)];
  }
  const double longest = (extent.bounds_max - extent.bounds_min).maxCoeff();
  report.triangles = input.triangles.size();
  CleanCounts cleaned;
  const Mesh mesh = join_vertices(input, cleaned);
  report.vertices = mesh.vertices.size();
  report.components = pieces_by_vertices(mesh.triangles, mesh.vertices.size()).count;
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  count_edges(uses, report);
  report.nonmanifold_vertices = count_nonmanifold_vertices(mesh, uses);
  const auto begin = [&](const char* step) {
    if (options.progress) options.progress(step, 0);
  };
  begin("check: crossing triangles");
  report.self_intersections = self_intersections(mesh).size();
  double volume6 = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector normal = mesh.area_normal(t);
    cleaned.collapsed += !(normal.squaredNorm() > 0);
    volume6 += (mesh.corner(t, 0) - extent.bounds_min).dot(normal);
  }
  report.collapsed = cleaned.collapsed;
  report.inside_out = report.open_edges == 0 && report.inconsistent_edges == 0 && volume6 < 0;
  Mesh without_duplicates = mesh;
  drop_duplicates(without_duplicates, cleaned);
  report.duplicates = cleaned.duplicates;

  const double voxel_size = options.voxel_size > 0   ? options.voxel_size
                            : options.resolution > 0 ? longest / options.resolution
                                                     : 0;
  try {
    RepairOutcome outcome;
    const Surface surface =
        check_mesh(input, {options.repair, voxel_size, options.sheet_thickness, report_steps(options)}, outcome);
    report.usable = true;
    report.repair = outcome.used;
    report.filled_share = outcome.filled_share;
    report.notes = outcome.notes;
    report.area = surface.area;
    report.volume = mass_properties(surface).volume;
    begin("check: walls");
    measure_walls(surface, voxel_size, report);
  } catch (const BakeError& error) {
    report.refusal = error.what();
  }
  return report;
}

}  // namespace vps::bake

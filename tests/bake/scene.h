// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Runs the first stages of baking on a mesh, for tests of the later stages.
#pragma once

#include "bake/plan.h"
#include "bake/repair/check.h"
#include "bake/stages/distance_field.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {

using namespace bake;

inline Surface checked(const TriangleMesh& mesh) {
  RepairOutcome outcome;
  return check_mesh(mesh, {}, outcome);
}

struct Scene {
  Surface surface;
  Grid grid;
  SurfaceVoxels voxels;
  InsideRuns runs;
  BandField field;

  Scene(const TriangleMesh& mesh, double voxel_size, double band_vx = 2.5)
      : Scene(mesh, voxel_size, band_vx, band_vx) {}

  Scene(const TriangleMesh& mesh, double voxel_size, double inside_vx, double outside_vx) {
    surface = checked(mesh);
    BakeOptions options;
    options.voxel_size = voxel_size;
    options.band_inside = inside_vx;
    options.band_outside = outside_vx;
    grid = plan_grid(extent_of(surface, measure_creases(surface)), options).grid;
    voxels = voxelize(surface, grid);
    runs = fill_inside(surface, grid);
    field = distance_field(surface, grid, runs, inside_vx * voxel_size, outside_vx * voxel_size);
  }
};

inline std::array<double, 3> to_array(const Vector& v) {
  return {v.x(), v.y(), v.z()};
}

/// A point on a triangle, uniform by area.
inline Vector point_on(const Surface& surface, std::size_t triangle, Random& random) {
  const double u = std::sqrt(random.next());
  const double v = random.next();
  return (1 - u) * surface.corner(triangle, 0) + u * (1 - v) * surface.corner(triangle, 1) +
         u * v * surface.corner(triangle, 2);
}

}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A mesh taken through the first stages of baking, for tests of the later ones.
#pragma once

#include "bake/check.h"
#include "bake/distance_field.h"
#include "bake/plan.h"
#include "tests/support/shapes.h"

namespace vps::test {

struct Scene {
  Surface surface;
  Grid grid;
  SurfaceVoxels voxels;
  InsideRuns runs;
  BandField field;

  Scene(const TriangleMesh& mesh, double voxel_size, double band_vx = 2.5) {
    std::vector<std::string> notes;
    surface = check_mesh(mesh, notes);
    BakeOptions options;
    options.voxel_size = voxel_size;
    options.band = band_vx;
    grid = plan_grid(surface, options).grid;
    voxels = voxelize(surface, grid);
    runs = fill_inside(surface, grid);
    field = distance_field(surface, grid, runs, band_vx * voxel_size);
  }
};

inline std::array<double, 3> to_array(const Vector& v) { return {v.x(), v.y(), v.z()}; }

/// Deterministic numbers in [0, 1).
class Random {
 public:
  double next() {
    state_ += 0x9E3779B97F4A7C15ull;
    std::uint64_t x = state_;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
  }
  double between(double low, double high) { return low + (high - low) * next(); }

 private:
  std::uint64_t state_ = 1;
};

/// A point on a triangle, uniform by area.
inline Vector point_on(const Surface& surface, std::size_t triangle, Random& random) {
  const double u = std::sqrt(random.next());
  const double v = random.next();
  return (1 - u) * surface.corner(triangle, 0) + u * (1 - v) * surface.corner(triangle, 1) +
         u * v * surface.corner(triangle, 2);
}

}  // namespace vps::test

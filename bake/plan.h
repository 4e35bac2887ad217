// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Chooses the grid before any work is done, and refuses absurd ones. Internal to bake.
#pragma once

#include "bake/grid.h"
#include "bake/stages/creases.h"
#include "bake/vps_bake.h"

namespace vps {

struct GridPlan {
  Grid grid;
  int precision = 0;  ///< p of Eq. (1), or kAutoPrecision
  double lambda = 0;  ///< step of the scaled field. [m]
  BakePlan plan;
};

/// What a grid depends on.
struct Extent {
  Vector bounds_min = Vector::Zero();
  Vector bounds_max = Vector::Zero();
  double area = 0;    ///< [m^2]
  double volume = 0;  ///< of closed meshes, without sign. [m^3]
  Creases creases;
  std::size_t triangles = 0;
};

/// Of the vertices that triangles use; without creases. @throw BakeError when there is none or an index or coordinate
/// is bad
[[nodiscard]] Extent measure_extent(const TriangleMesh& mesh);

[[nodiscard]] Extent extent_of(const Surface& surface);

/// @throw BakeError when an option is out of range or the grid does not suit the mesh
[[nodiscard]] GridPlan plan_grid(const Extent& mesh, const BakeOptions& options);

/// Largest integer that `scaled` may hold: 127 or 32767, or more than that when neither suffices for the band.
[[nodiscard]] std::int32_t scaled_limit(const BakeOptions& options, double voxel_size, double lambda);

/// "0.5 mm", "3.2 m": a length with the unit that suits it.
[[nodiscard]] std::string format_length(double metres);
/// "12 MB", in powers of 1000.
[[nodiscard]] std::string format_bytes(double bytes);

}  // namespace vps

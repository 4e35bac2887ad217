// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How thick the solid is under its surface. Internal to bake.
#pragma once

#include <span>

#include "bake/stages/distance_field.h"
#include "bake/stages/triangle_tree.h"

namespace vps::bake {

struct SurfacePoint {
  Vector position = Vector::Zero();
  Vector inward_normal = Vector::Zero();
};

/// Points spread evenly over the surface, the same for every run.
[[nodiscard]] std::vector<SurfacePoint> spread_points(const Surface& surface, std::size_t count);

/// Length of the ray from each point along its inward normal to the next wall. Infinite unless that wall's outward
/// normal is within 45 degrees of the ray: under an edge of a box the next face is near, but it is no wall. [m]
[[nodiscard]] std::vector<double> wall_thickness(const Surface& surface, std::span<const SurfacePoint> points);

struct ThinWalls {
  double share = 0;               ///< of the points
  double thinnest = 0;            ///< [m]
  Vector place = Vector::Zero();  ///< where
};

/// Points whose wall is thinner than two voxels. The field picks the candidates, rays measure them.
/// @param points  spread evenly
[[nodiscard]] ThinWalls find_thin_walls(const Surface& surface, const TriangleTree& tree, const Grid& grid,
                                        const InsideRuns& runs, const BandField& field,
                                        std::span<const SurfacePoint> points);

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The pointshell: points on the surface with inward normals and areas. Paper: Sec. 2.1.2. Internal to bake.
#pragma once

#include <span>

#include "bake/loop_progress.h"
#include "bake/stages/distance_field.h"
#include "bake/stages/find_corners.h"
#include "bake/stages/fit_facets.h"

namespace vps::bake {

/// A facet of a point's part of the surface.
struct PointFacet {
  std::uint32_t point;
  Facet corners;  ///< relative to the point. [m]
};

struct Pointshell {
  std::vector<Vector> positions;       ///< on the surface. [m]
  std::vector<Vector> inward_normals;  ///< unit, rounded to what the asset can hold
  std::vector<double> areas;           ///< they sum to the surface's area. [m^2]
  std::vector<PointFacet> facets;      ///< of the points whose part of the surface is folded, by point
  std::vector<std::uint8_t> on_face;   ///< of a thinned shell: whether a point lies inside a face; else empty
  std::vector<std::uint32_t> faces;    ///< number of the flat face in which a point lies; 0: none
  double spacing = 0;                  ///< points on the same side are no closer than this. [m]
  double normal_error_mean = 0;        ///< angle to the face's normal, over points that lie on no sharp edge. [rad]
  double normal_error_max = 0;         ///< the worst of these. [rad]
  double covering_radius = 0;          ///< proven: every surface point has a shell point no farther than this. [m]
  double feature_covering_radius = 0;  ///< proven: the same for places whose point was not thinned out. [m]
};

/// @param spacing  alpha * s. [Units: m]
/// @param thin     see BakeOptions::thin_faces
/// @param corners  of the surface: points are placed there first, so that no tip is cut
[[nodiscard]] Pointshell sample_pointshell(const Surface& surface, std::span<const Corner> corners, const Grid& grid,
                                           const SurfaceVoxels& voxels, const InsideRuns& runs, const BandField& field,
                                           double spacing, double thin, const StageProgress& progress = {});

}  // namespace vps::bake

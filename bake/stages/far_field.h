// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Coarse samples of V for the places beyond the narrow band. Internal to bake.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/stages/certify.h"

namespace vps::bake {

/// V at the nodes of a regular grid that covers the mesh's bounds and `range` around them. docs/internals/format.md,
/// "The far grid".
struct FarField {
  Index3 dims{};                          ///< nodes
  Vector origin = Vector::Zero();         ///< node (0,0,0). [m]
  double spacing = 0;                     ///< a whole number of voxels. [m]
  double step_inner = 0, step_outer = 0;  ///< of values above and below 0. [m]
  double range = 0;                       ///< [m]
  std::vector<std::int8_t> values;        ///< [nz,ny,nx]
  FieldCertificate error;

  /// V by trilinear interpolation. @pre the point lies in the grid
  [[nodiscard]] double value(const Vector& point) const;
};

/// The grid's nodes and the points of its certificate lie at most this far from the mesh's bounds, along each axis.
inline constexpr double kFarReach_vx = 160;

/// What the stages before know about distances.
struct FarSource {
  const Surface& surface;
  const Distances& distances;
  const InsideTest& inside;
  const Grid& grid;
  const std::vector<std::int16_t>& coarse_layers;
};

/// Samples exact distances. The spacing is the least with which the values take a few per cent of an asset with all its
/// usual parts. It depends on the mesh and the voxel size alone, so that V does not depend on the parts that are baked.
/// @param least  depth and distance from which queries use the grid: the certificate starts there. [Units: m]
[[nodiscard]] FarField far_field(const FarSource& from, double least, std::uint64_t surface_voxels);

}  // namespace vps::bake

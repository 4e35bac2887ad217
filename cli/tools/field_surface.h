// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The surface that an asset's field describes, as triangles: an asset holds no mesh.
#pragma once

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

struct FieldSurface {
  TriangleMesh mesh;
  double step = 0;      ///< edge of the cells that it was made in. [m]
  double residual = 0;  ///< largest |V| at its vertices and in the middle of its triangles [m]; add the field's error
};

/// Dual surface of V = 0 (surface nets, one vertex for each sheet in a cell): closed whatever the field, every directed
/// edge as often as its reverse; wound counter-clockwise seen from outside. Vertices are moved onto V = 0 but for
/// Field::layers, whose steps they average. Details thinner than a step are lost. Same field and step, same mesh.
/// @param step  [Limits: value >= voxel_size / 4] [Units: m]
/// @throw std::invalid_argument for a smaller one
[[nodiscard]] FieldSurface make_field_surface(const VoxelmapView& map, double step);

/// The step, no less than a voxel nor a 1024th of the longest side, with which about `triangles` come out, or fewer.
/// [m]
[[nodiscard]] double step_for(const AssetInfo& info, double triangles);

}  // namespace vps::cli

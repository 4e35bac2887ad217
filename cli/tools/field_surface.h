// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The surface that an asset's field describes, as triangles: an asset holds no mesh.
#pragma once

#include <stdexcept>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

struct FieldSurface {
  TriangleMesh mesh;
  double step = 0;      ///< edge of the cells of its grid. [m]
  double residual = 0;  ///< largest |V| at its vertices and in the middle of its triangles [m]; add the field's error
};

/// There is no such surface. `what()` is "reason; what to do".
struct FieldSurfaceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Dual surface of V = 0, one vertex for each sheet in a cell. It is closed for any field: every directed edge occurs
/// as often as its reverse. Triangles are counter-clockwise seen from outside. Where the normals in a cell differ, its
/// vertex lies on the edge or corner that the tangent planes make; other vertices lie on V = 0. With Field::layers
/// vertices average its steps. Details thinner than a step are lost. The same field and step give the same mesh.
/// @param step  [Limits: value >= voxel_size / 4] [Units: m]
/// @throw std::invalid_argument for a smaller one; FieldSurfaceError when there are too many cells, and for a field
/// that is no distance
[[nodiscard]] FieldSurface make_field_surface(const VoxelmapView& map, double step);

/// The step that gives about `triangles` triangles or fewer; at least `finest` voxels, and at least 1/1024 of the
/// longest side. [m]
[[nodiscard]] double step_for(const AssetInfo& info, double triangles, double finest = 1);

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What `vpsbake export` writes for other programs, one function for each format; docs/assets.md has the formats.
/// Everything is in metres, asset frame.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "runtime/vps_runtime.h"

namespace vps::cli {

/// The export is not possible. `what()` is "reason; what to do".
struct ExportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The pointshell as binary PLY: float x y z, nx ny nz (OUTWARD, as mesh programs expect), area; uint leaf, segment.
[[nodiscard]] std::string to_ply(const Asset& asset);

/// Scalars, sections, points and tree as JSON; docs/schemas/asset.schema.json.
[[nodiscard]] std::string to_json_text(const std::string& path, const Asset& asset);

/// The surface V = 0 as OBJ. @param step  edge of the cells of its grid. [Limits: value >= voxel_size / 4] [m]
/// @throw ExportError where no cell has a part of the surface in it; FieldSurfaceError
[[nodiscard]] std::string to_obj(const VoxelmapView& map, double step);

struct CdfOptions {
  double step = 0;   ///< edge of a cell. [Limits: value >= voxel_size / 4] [Units: m]
  double reach = 0;  ///< how far outside the distances go. [Limits: value >= 0] [Units: m]
};

/// Discregrid's format, as Bullet's btSdfCollisionShape::initializeSDF reads it: signed distance, negative inside, in
/// cells of 32 nodes. Cells beyond the reach are left out. Beyond the band, a distance is the sum of a stored one and
/// the length of the straight line between the two nodes.
/// @throw ExportError for layers, and when there are too many cells or the file would be too large for Bullet
[[nodiscard]] std::string to_cdf(const VoxelmapView& map, const CdfOptions& options);

/// The field on a regular grid as VTKHDF ImageData, in the arrays penetration, stored and, with layers, layer.
/// @param step  between points; the first is the centre of voxel (0,0,0). [m]
/// @return the size of the file. [bytes]
/// @throw ExportError for more than 64 Mi points; WriteError
std::size_t write_vtkhdf_field(const Asset& asset, const VoxelmapView& map, double step,
                               const std::filesystem::path& output);

}  // namespace vps::cli

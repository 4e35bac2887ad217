// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The data of an asset for cli/tools/view/pages/view.html, reduced to fit a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

/// Triangles of a surface on a page: at most for a given mesh, approximately for the surface of a field.
inline constexpr std::size_t kPageTriangles = 120'000;

/// `name`, `about` (a sentence), `facts` (pairs of texts), bounds, and an object for each of surface, mesh, voxels,
/// field, points and spheres: its arrays and a `note` that says how they were made, or `missing` with the reason.
/// @param mesh  the mesh that the asset was baked from; null: none is laid over the surface. Without a voxelmap it is
/// the surface
[[nodiscard]] nlohmann::ordered_json view_data(const Asset& asset, const std::string& name, const TriangleMesh* mesh);

/// Origin of a page's numbers: the program's version, and the command that makes the page again; pairs of texts.
[[nodiscard]] nlohmann::ordered_json origin_facts();

/// The surface of the field for a page: the members of `pack_mesh` and `note`; or `missing` with the reason.
/// @param mesh  to measure its vertices against: `errors` (u8: part of `most`, 255 is all of it) and `most` [m]; or
/// null
[[nodiscard]] nlohmann::ordered_json pack_field_surface(const Asset& asset, std::size_t triangles,
                                                        const TriangleMesh* mesh = nullptr);

}  // namespace vps::cli

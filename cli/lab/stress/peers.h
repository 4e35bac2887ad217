// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What the peers of `vpsbake stress` are made of: the mesh that was given, or the asset's own zero set.
#pragma once

#include <optional>
#include <string>

#include "cli/lab/stress/stress.h"

namespace vps::cli {

/// Why this cannot be the mesh that the asset was baked from, and what to do; empty when it can: its bounds are within
/// two voxels of the asset's, for repairs may move a vertex, and what it encloses when it is closed as a bake closes it
/// within 5 % of the asset's volume. Not compared is the volume of what cannot be closed, or where patches over holes
/// are more than a tenth of the surface: these depend on how it was baked.
[[nodiscard]] std::string mesh_mismatch(const TriangleMesh& mesh, const AssetInfo& info);

/// The surface on which an asset's field is 0, of about 2,000 triangles; of more where the body is too thin for such
/// large cells. None without a voxelmap, or where the field is nowhere 0.
[[nodiscard]] std::optional<stress::PeerMesh> zero_set(const Asset& asset);

}  // namespace vps::cli

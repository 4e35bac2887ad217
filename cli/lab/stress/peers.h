// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The mesh for the other collision shapes of `vpsbake stress`: the one given, or the asset's zero set.
#pragma once

#include <optional>
#include <string>

#include "cli/lab/stress/stress.h"

namespace vps::cli {

/// Why this cannot be the mesh that the asset was baked from, and what to do; empty when it can. Its bounds must be
/// within two voxels of the asset's, since repairs may move a vertex. Its volume, as it is or closed as a bake closes
/// it, must be within 5 % of the asset's. The volume is not compared when the mesh cannot be closed or when patches
/// over holes are more than a tenth of the surface: it then depends on how the asset was baked.
[[nodiscard]] std::string mesh_mismatch(const TriangleMesh& mesh, const AssetInfo& info);

/// The surface on which an asset's field is 0, with about 2,000 triangles, or more where the body is too thin for such
/// large cells. Nothing without a voxelmap, or where the field is nowhere 0.
[[nodiscard]] std::optional<stress::PeerMesh> zero_set(const Asset& asset);

}  // namespace vps::cli

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Whether the bounds of a mesh are those of an asset.
#pragma once

#include <string>

#include "bake/extent.h"

namespace vps {
struct AssetInfo;
}

namespace vps::cli {

/// Largest difference between a side of a mesh's bounds and of an asset's. [m]
[[nodiscard]] double bounds_off(const bake::Extent& extent, const AssetInfo& info);

/// Why a mesh cannot be an asset's, and what to do; empty when their bounds agree to two voxels: repairs may move a
/// vertex.
/// @throw bake::BakeError when the mesh has no triangle, or an index or coordinate is bad
[[nodiscard]] std::string mesh_refusal(const TriangleMesh& mesh, const AssetInfo& info);

}  // namespace vps::cli

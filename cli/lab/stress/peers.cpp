// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/stress/peers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bake/extent.h"
#include "bake/quantity_text.h"
#include "bake/vps_bake.h"
#include "cli/tools/field_surface.h"
#include "cli/tools/mesh_bounds.h"

namespace vps::cli {
namespace {

constexpr double kTriangles = 2000;  // with so many GImpact takes no longer than a baked asset

bool is_off(double volume, const AssetInfo& info, double tolerance = 0.05) {
  return !(std::abs(volume - info.volume) <= tolerance * info.volume);
}

// Volume of the mesh as a bake closes it; the asset's volume where the mesh cannot be compared. [m^3]
double closed_volume(const TriangleMesh& mesh, const AssetInfo& info) {
  constexpr double kPatched = 0.1;
  bake::BakeOptions options;
  options.voxel_size = info.voxel_size;
  try {
    const bake::ClosedMesh closed = bake::closed_mesh(mesh, options);
    return closed.filled_share > kPatched ? info.volume : bake::measure_extent(closed.mesh).volume;
  } catch (const bake::BakeError&) {
    return info.volume;
  }
}

}  // namespace

std::string mesh_mismatch(const TriangleMesh& mesh, const AssetInfo& info) {
  if (std::string reason = mesh_refusal(mesh, info); !reason.empty()) return reason;
  // Either the closed or the unchanged mesh may match: it depends on how the asset was baked.
  const double volume = closed_volume(mesh, info);
  if (is_off(volume, info) && is_off(bake::measure_extent(mesh).volume, info)) {
    return fmt::format("the mesh encloses {:.3g} m^3, the asset {:.3g} m^3; give the mesh that it was baked from",
                       volume, info.volume);
  }
  return "";
}

std::optional<stress::PeerMesh> zero_set(const Asset& asset) {
  VoxelmapView map;
  if (asset.voxelmap(map) != Status::ok) return std::nullopt;
  const AssetInfo& info = asset.info();
  for (double step = step_for(info, kTriangles);; step = std::max(0.7 * step, info.voxel_size)) {
    FieldSurface surface = make_field_surface(map, step);
    const bool is_last = step <= info.voxel_size;
    if (surface.mesh.triangles.empty()) {
      if (is_last) return std::nullopt;
      continue;
    }
    // Large cells lose thin parts: then a smaller step is tried.
    const bake::Extent extent = bake::measure_extent(surface.mesh);
    if (!is_last && (is_off(extent.volume, info, 0.1) || bounds_off(extent, info) > 2 * step)) continue;
    std::string from = fmt::format("the asset's zero set, {} triangles in cells of {}", surface.mesh.triangles.size(),
                                   bake::format_length(step));
    return stress::PeerMesh{std::move(surface.mesh), std::move(from)};
  }
}

}  // namespace vps::cli

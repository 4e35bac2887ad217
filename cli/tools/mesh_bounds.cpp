// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/mesh_bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bake/quantity_text.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

double bounds_off(const bake::Extent& extent, const AssetInfo& info) {
  double off = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    off = std::max({off, std::abs(extent.bounds_min[k] - info.bounds_min[axis]),
                    std::abs(extent.bounds_max[k] - info.bounds_max[axis])});
  }
  return off;
}

std::string mesh_refusal(const TriangleMesh& mesh, const AssetInfo& info) {
  const bake::Extent extent = bake::measure_extent(mesh);
  const double off = bounds_off(extent, info);
  if (off <= 2 * info.voxel_size) return "";
  const auto size = [](const auto& low, const auto& high) {
    return fmt::format("{} x {} x {}", bake::format_length(high[0] - low[0]), bake::format_length(high[1] - low[1]),
                       bake::format_length(high[2] - low[2]));
  };
  return fmt::format(
      "the asset was not baked from this mesh: its bounds are {} off, {} against {}; check --unit and --scale",
      bake::format_length(off), size(extent.bounds_min, extent.bounds_max), size(info.bounds_min, info.bounds_max));
}

}  // namespace vps::cli

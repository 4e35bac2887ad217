// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a field holds at a point, for pictures: queries may claim less distance where nothing is stored. And
/// where pictures look.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "runtime/fields/penetration.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

/// V, where it is stored, of layers those of the voxel; elsewhere infinite with the right sign. [m]
inline float stored_penetration(const VoxelmapView& map, Vec3 point) {
  const float v = penetration(map, point, Vec3{});
  bool stored = false;
  if (map.field == Field::layers) {
    const detail::Voxel found = detail::find_voxel(map, point);
    stored = found.in_grid && map.brick_index[found.brick] != kNoBrick;
  } else {
    stored = octree::is_brick(detail::find_cell(map, point).entry);
  }
  return stored ? v : std::copysign(std::numeric_limits<float>::infinity(), v);
}

/// Layer v of a voxel. @param brick  stored, of Field::layers
inline int layer_at(const VoxelmapView& map, std::uint32_t brick, std::size_t voxel) {
  const std::size_t at = std::size_t{brick} * kBrickVoxels + voxel;
  return map.element == ElementType::i8 ? static_cast<const std::int8_t*>(map.values)[at]
                                        : static_cast<const std::int16_t*>(map.values)[at];
}

/// Places along an axis that slices are drawn at: the body and the band round it, asset frame. [m]
struct SliceRange {
  double low = 0, high = 0;
  double middle = 0;  ///< of the body: where a slice is drawn when no place is said
};
[[nodiscard]] inline SliceRange slice_range(const AssetInfo& info, std::size_t axis) {
  const double low = info.bounds_min[axis], high = info.bounds_max[axis];
  return {low - info.band_outer, high + info.band_outer, (low + high) / 2};
}

/// As the command line and docs/format.md call it.
[[nodiscard]] inline const char* field_name(Field field) {
  return field == Field::real ? "real" : field == Field::scaled ? "scaled" : "layers";
}
/// The other way; Field::none, the finest stored, for an empty name.
[[nodiscard]] inline Field field_of(const std::string& name) {
  return name == "layers"   ? Field::layers
         : name == "scaled" ? Field::scaled
         : name == "real"   ? Field::real
                            : Field::none;
}

}  // namespace vps::cli

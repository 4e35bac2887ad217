// SPDX-License-Identifier: GPL-3.0-or-later
/// @file For pictures: the stored values of a field, and the range of slices. Queries may return less than the distance
/// where nothing is stored.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "runtime/fields/penetration.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

/// V where it is stored, with layers that of the voxel; elsewhere infinite with the right sign. [m]
inline float stored_penetration(const VoxelmapView& map, Vec3 point) {
  const float v = penetration(map, point, Vec3{});
  bool stored = false;
  if (map.field == Field::layers) {
    const detail::Voxel found = detail::find_voxel(map, point);
    stored = detail::has_layer(map, found);
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

/// Range of slices along an axis: the body and the band around it, asset frame. [m]
struct SliceRange {
  double low = 0, high = 0;
  double middle = 0;  ///< of the body: the default place of a slice
};
[[nodiscard]] inline SliceRange slice_range(const AssetInfo& info, std::size_t axis) {
  const double low = info.bounds_min[axis], high = info.bounds_max[axis];
  return {low - info.band_outer, high + info.band_outer, (low + high) / 2};
}

/// Name of a field, as on the command line and in docs/internals/format.md.
[[nodiscard]] inline const char* field_name(Field field) {
  return field == Field::real ? "real" : field == Field::scaled ? "scaled" : "layers";
}
/// The field of a name; for an empty name Field::none, the finest stored.
[[nodiscard]] inline Field field_of(const std::string& name) {
  return name == "layers"   ? Field::layers
         : name == "scaled" ? Field::scaled
         : name == "real"   ? Field::real
                            : Field::none;
}

}  // namespace vps::cli

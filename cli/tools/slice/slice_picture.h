// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A slice of a field as a picture: a colour for each voxel of distance, a line where it is 0, axes, a legend.
#pragma once

#include <string>

#include "cli/tools/slice/picture.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

/// The unit in which a length of this size is read best, from um to km.
class LengthUnit {
 public:
  explicit LengthUnit(double length);
  /// The length in this unit, with six digits.
  [[nodiscard]] std::string number(double length) const;
  [[nodiscard]] const char* name() const { return name_; }

 private:
  const char* name_;
  double size_;  ///< [m]
};

struct SliceOptions {
  std::string name;      ///< of the asset, for the heading
  std::size_t axis = 2;  ///< normal to the slice: 0 is x
  double at = 0;         ///< [Limits: slice_range] [Units: m]
  int width = 900;       ///< of the picture [Limits: 600 <= value <= 8000] [Units: px]
};

struct SlicePicture {
  Picture picture;
  double pixel = 0;     ///< edge of the plot's pixels. [m]
  std::string place;    ///< "z = 12 mm"
  std::string no_line;  ///< why there is no line where the distance is 0; empty when there is one
};

/// @param map  of the asset
[[nodiscard]] SlicePicture draw_slice(const AssetInfo& info, const VoxelmapView& map, const SliceOptions& options);

}  // namespace vps::cli

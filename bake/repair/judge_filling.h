// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Whether a filled mesh is the only solid that a person would see in an open one. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

/// A mesh whose holes were filled, before its shells are united.
struct Filling {
  Mesh mesh;
  std::size_t patches = 0;  ///< the first triangle of the patches, which come last
};

/// What speaks against the solid that filling makes.
struct FillingDoubts {
  /// Share of the solid's volume that the open mesh hardly surrounds: its winding number is below 2/3 there. Large
  /// where a hole is as wide as what lies behind it, as in a box without a lid, which may be a solid or have thin
  /// walls.
  double volume = 0;
  /// Share of the mesh's area that sheets have: with their patches they enclose no volume, and are dropped.
  double sheets = 0;
};

/// Drops sheets that lie on their patches. They bound nothing, and to unite thousands that cross takes minutes.
/// @param patches  as in Filling
/// @return number dropped
std::size_t drop_flat_sheets(Mesh& mesh, std::size_t patches);

/// @param solid  the filling after its shells are united, not empty
[[nodiscard]] FillingDoubts judge_filling(const Filling& filling, const Mesh& solid);

}  // namespace vps::bake

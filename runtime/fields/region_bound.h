// SPDX-License-Identifier: Zlib
/// @file One linear bound of V for a whole region of a sampled field, from the planes of its cells. Internal.
#pragma once

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// The bound of a region: docs/internals/bounds.md, "A plane for a region". It costs some nanoseconds a cell.
/// @param map   with planes
/// @param low, high  corners of the region. [vx]
/// @return not tight where it would reject little, or where the region has too many cells
RegionBound bound_region(const VoxelmapView& map, const float (&low)[3], const float (&high)[3]) noexcept;

/// Keeps the bound of a box around a sphere in a cache, until the sphere leaves the box.
/// @param map     scaled, with planes; `field` is its id
/// @param centre, radius, distance  the box reaches some voxels farther from the sphere than `distance`. [vx]
/// @return how far the sphere is from the faces of the box. [vx]
float keep_region(const VoxelmapView& map, std::uint64_t field, const float (&centre)[3], float radius, float distance,
                  ContactCache& cache) noexcept;

/// The bound at points of a shell, by their codes: normal . code + height. In a sphere of the tree it is at most that
/// at the centre and the radius.
struct CodeBound {
  float normal[3] = {}, height = 0;  ///< [vx]
};
/// @param points    takes codes to the field. [vx]
/// @param rounding  of the field's coordinates. [vx]
CodeBound bound_of_codes(const RegionBound& bound, const Affine& points, float rounding) noexcept;

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file The part of a flat facet that lies in a field, as one contact. Internal. Eqs. (2) and (3) of the paper give
/// the whole area of a point one V and one normal.
#pragma once

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// Integrates V over the part of a facet where V >= 0; V is linear on each of the facet's two triangles.
/// @param corners  counter-clockwise seen from outside; a triangle repeats its last corner. [m]
/// @param v        at the corners. [m]
/// @param contact  set where the part has an area. `position` is the centre of pressure, `penetration` is V there,
///                 `area` is the integral of V divided by it, and the normal is the facet's
/// @return whether the part has an area
bool cut_facet(const Vec3 (&corners)[4], const float (&v)[4], Contact& contact) noexcept;

}  // namespace vps::detail

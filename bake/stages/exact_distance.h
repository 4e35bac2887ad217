// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Distance from a point to few triangles, by CGAL: for the certificate. Internal to bake.
#pragma once

#include <cstdint>
#include <span>

#include "bake/geometry.h"

namespace vps::bake {

/// Unsigned distance from the nearest of some triangles; infinite without any. [m]
[[nodiscard]] double exact_distance(const Surface& surface, const Vector& point, std::span<const std::uint32_t> among);

}  // namespace vps::bake

// SPDX-License-Identifier: Zlib
/// @file A walk to the surface that starts anywhere. Internal.
#pragma once

#include "runtime/vps_queries.h"

namespace vps::detail {

/// `closest_point`, with a walk that starts at another place than the point: at the part of the surface that is known
/// to be near it. [m]
[[nodiscard]] Status closest_point_from(const VoxelmapView& map, Vec3 point, Vec3 start,
                                        const ClosestPointOptions& options, ClosestPoint& result) noexcept;

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file The plane that a sampled surface may be. Internal.
#pragma once

#include <optional>

#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {

inline constexpr float kFlat_vx = 0.05F;  ///< V over flat ground differs by no more from the plane's
inline constexpr float kTop_vx = 0.15F;   ///< V over tops: samples beside edges are fitted to more than a plane

/// The plane through the surface below a place: that of the least squares, of places in a square, whose V are rounded.
/// Nothing where they are in no plane.
/// @param radius  of the ball in which the plane is sought. [m]
std::optional<HalfSpaceField> fit_plane(const VoxelmapView& map, Vec3 centre, float radius);

/// The same where only parts of the surface are in a plane, as with slots between plates.
std::optional<HalfSpaceField> fit_top(const VoxelmapView& map, Vec3 centre, float radius);

}  // namespace vps::detail

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file By how much a point comes nearer to a field in a motion, as the search for contacts ahead reckons.
#pragma once

#include <algorithm>
#include <optional>
#include <type_traits>

#include "runtime/fields/penetration.h"
#include "runtime/fields/place_field.h"

namespace vps::test {

/// @param at, way  of the point, field's frame. [m]
inline double growth(FieldRef field, const PointshellView& shell, const Pose& shell_to_field, Vec3 at, Vec3 way) {
  const auto lost = [&](Vec3 up) { return std::max(0.0, -double{detail::dot(up, way)}); };
  return field.visit([&]<class Kind>(const Kind& kind) {
    if constexpr (std::is_same_v<Kind, HalfSpaceField>) return lost(kind.outward_normal);
    if constexpr (std::is_same_v<Kind, BoxField>) {
      if (const auto faces = detail::faces_near(kind, shell, shell_to_field)) {
        const Vec3 up = faces->upper.outward_normal;
        return lost(detail::dot(up, at) >= 0 ? up : detail::operator*(-1.0F, up));
      }
    }
    return double{detail::length(way)};
  });
}

}  // namespace vps::test

// SPDX-License-Identifier: Zlib
/// @file Where a field is linear. Internal. Proofs: docs/internals/bounds.md, "Flat nodes".
#pragma once

#include <span>

#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {

/// A linear function of the place. Field's frame.
struct LinearPart {
  Vec3 place;
  Vec3 slope;   ///< [-]
  float v = 0;  ///< at `place`. [m]
  [[nodiscard]] float at(Vec3 p) const noexcept { return v + dot(slope, p - place); }
};

/// The field's linear part at a place. V of a convex body is concave, and nowhere above it.
/// @param v  V there. [m]
template <class Analytic>
LinearPart linear_part(const Analytic& field, Vec3 place, float v) noexcept {
  return {place, -1.0F * normal_at(field, place), v};
}
LinearPart linear_part(const VoxelmapView& map, Vec3 place, float v) noexcept;

/// V's rounding at the samples. [m]
template <class Analytic>
float rounding_of(const Analytic&) noexcept {
  return 0;
}
float rounding_of(const VoxelmapView& map) noexcept;

/// The linear function nearest to V at places in a plane, which slopes as a distance does. Samples are rounded, so that
/// the slope between two is off by too much for a large face.
/// @param part  near one of the places
/// @param v     at the places. [unit]
/// @param unit  [m]
template <class Analytic>
LinearPart fit_linear(const Analytic&, const LinearPart& part, std::span<const Vec3>, std::span<const float>,
                      float) noexcept {
  return part;
}
LinearPart fit_linear(const VoxelmapView& map, const LinearPart& part, std::span<const Vec3> places,
                      std::span<const float> v, float unit) noexcept;

/// Whether V differs from a linear function by no more than `tolerance` in the convex hull of some places, if it does
/// so at these places. V of a convex body does.
template <class Analytic>
bool is_linear_between(const Analytic&, const LinearPart&, std::span<const Vec3>, float, std::uint32_t) noexcept {
  return true;
}
/// Over the faces of a rounded body, V is that of the planes.
bool is_linear_between(const PolytopeField& solid, const LinearPart& part, std::span<const Vec3> places,
                       float tolerance, std::uint32_t most) noexcept;
/// @param places  in a plane
/// @param most    tests of points that a check may cost; if it costs more, the answer is false
bool is_linear_between(const VoxelmapView& map, const LinearPart& part, std::span<const Vec3> places, float tolerance,
                       std::uint32_t most) noexcept;

/// Whether the surface in a ball is a plane: V is minus the height over it up to a voxel, and nothing lies higher.
/// docs/internals/bounds.md, "A plane in place of the map".
/// @param map     scaled
/// @param most    as above, twice
bool is_plane_within(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre, float radius, float tolerance,
                     std::uint32_t most) noexcept;
/// Whether no surface in a ball is above a plane. Below it anything may be, or nothing.
bool is_all_below(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre, float radius, float tolerance,
                  std::uint32_t most) noexcept;

}  // namespace vps::detail

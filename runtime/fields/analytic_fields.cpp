// SPDX-License-Identifier: Zlib
// Analytic fields: V and the outward normal, point by point.
#include "runtime/fields/analytic_fields.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/fields/penetration.h"
#include "runtime/fields/place_field.h"

namespace vps::detail {
namespace {

float below(const HalfSpaceField& plane, Vec3 p) noexcept {
  return plane.offset - dot(plane.outward_normal, p);
}

// V and the normal in a half plane through the axis of a solid of revolution.
struct InProfile {
  float v = 0;
  float normal_r = 0, normal_z = 1;  // outward
};

InProfile away_from(float r, float z, float radius, float rounding) noexcept {
  const float distance = std::hypot(r, z);
  InProfile out;
  out.v = radius + rounding - distance;
  if (distance > 0) {
    out.normal_r = r / distance;
    out.normal_z = z / distance;
  }
  return out;
}

InProfile in_cylinder(const RevolvedField& solid, float r, float z) noexcept {
  const float beyond_r = r - solid.radius;
  const float beyond_z = std::abs(z) - solid.half_height;
  const float up = z < 0 ? -1.0F : 1.0F;
  if (beyond_r > 0 || beyond_z > 0) {
    return away_from(std::max(beyond_r, 0.0F), up * std::max(beyond_z, 0.0F), 0, solid.rounding);
  }
  if (beyond_r > beyond_z) return {solid.rounding - beyond_r, 1, 0};
  return {solid.rounding - beyond_z, 0, up};
}

InProfile in_cone(const RevolvedField& solid, float r, float z) noexcept {
  const ConeSlant slant(solid);
  const float height = 2 * solid.half_height;
  const float down = solid.half_height - z;
  const float over_slant = slant.normal_r * r - slant.normal_z * down;
  const float below_base = down - height;
  if (over_slant <= 0 && below_base <= 0) {
    if (over_slant > below_base) return {solid.rounding - over_slant, slant.normal_r, slant.normal_z};
    return {solid.rounding - below_base, 0, -1};
  }
  const float t = std::clamp(slant.along_r * r + slant.along_z * down, 0.0F, 1.0F);
  const InProfile from_slant = away_from(r - t * solid.radius, t * height - down, 0, solid.rounding);
  const InProfile from_base = away_from(std::max(r - solid.radius, 0.0F), -below_base, 0, solid.rounding);
  return from_slant.v > from_base.v ? from_slant : from_base;
}

InProfile in_profile(const RevolvedField& solid, float r, float z) noexcept {
  switch (solid.profile) {
    case RevolvedField::Profile::capsule:
      return away_from(r, z - std::clamp(z, -solid.half_height, solid.half_height), solid.radius, solid.rounding);
    case RevolvedField::Profile::cylinder:
      return in_cylinder(solid, r, z);
    case RevolvedField::Profile::cone:
      return in_cone(solid, r, z);
  }
  return {};
}

}  // namespace

float value_at(const BoxField& box, Vec3 p) noexcept {
  const Vec3 q{std::abs(p.x) - box.half_extents.x, std::abs(p.y) - box.half_extents.y,
               std::abs(p.z) - box.half_extents.z};
  const Vec3 outside{std::max(q.x, 0.0F), std::max(q.y, 0.0F), std::max(q.z, 0.0F)};
  return -length(outside) - std::min(std::max({q.x, q.y, q.z}), 0.0F);
}
float value_at(const SphereField& sphere, Vec3 p) noexcept {
  return sphere.radius - length(p);
}
float value_at(const HalfSpaceField& plane, Vec3 p) noexcept {
  return below(plane, p);
}
float value_at(const RevolvedField& solid, Vec3 p) noexcept {
  return in_profile(solid, std::hypot(p.x, p.y), p.z).v;
}
float value_at(const PolytopeField& solid, Vec3 p) noexcept {
  // Four at once: each minimum waits for the one before.
  constexpr std::size_t kAtOnce = 4;
  float least[kAtOnce];
  std::fill_n(least, kAtOnce, std::numeric_limits<float>::infinity());
  const std::span<const HalfSpaceField> planes = solid.planes;
  std::size_t i = 0;
  for (; i + kAtOnce <= planes.size(); i += kAtOnce) {
    for (std::size_t k = 0; k < kAtOnce; ++k) least[k] = std::min(least[k], below(planes[i + k], p));
  }
  for (; i < planes.size(); ++i) least[0] = std::min(least[0], below(planes[i], p));
  return std::min(std::min(least[0], least[1]), std::min(least[2], least[3]));
}

Vec3 normal_at(const BoxField& field, Vec3 point) noexcept {
  const float half[3] = {field.half_extents.x, field.half_extents.y, field.half_extents.z};
  const float at[3] = {point.x, point.y, point.z};
  float out[3];
  int face = 0;
  for (int axis = 0; axis < 3; ++axis) {
    out[axis] = at[axis] - std::min(std::max(at[axis], -half[axis]), half[axis]);
    if (std::abs(at[axis]) - half[axis] > std::abs(at[face]) - half[face]) face = axis;
  }
  const float distance = length({out[0], out[1], out[2]});
  if (distance > 0) return {out[0] / distance, out[1] / distance, out[2] / distance};
  float normal[3] = {0, 0, 0};
  normal[face] = at[face] < 0 ? -1.0F : 1.0F;
  return {normal[0], normal[1], normal[2]};
}
Vec3 normal_at(const SphereField&, Vec3 point) noexcept {
  const float distance = length(point);
  return distance > 0 ? Vec3{point.x / distance, point.y / distance, point.z / distance} : Vec3{0, 0, 1};
}
Vec3 normal_at(const HalfSpaceField& plane, Vec3) noexcept {
  return plane.outward_normal;
}
Vec3 normal_at(const RevolvedField& solid, Vec3 p) noexcept {
  const float r = std::hypot(p.x, p.y);
  const InProfile at = in_profile(solid, r, p.z);
  if (r > 0) return {at.normal_r * p.x / r, at.normal_r * p.y / r, at.normal_z};
  return {at.normal_r, 0, at.normal_z};
}
Vec3 normal_at(const PolytopeField& solid, Vec3 p) noexcept {
  const float least = value_at(solid, p);
  const auto nearest = std::find_if(solid.planes.begin(), solid.planes.end(),
                                    [&](const HalfSpaceField& plane) { return below(plane, p) == least; });
  return nearest != solid.planes.end() ? nearest->outward_normal : Vec3{0, 0, 1};
}

std::optional<FacePair> faces_near(const BoxField& box, const PointshellView& shell,
                                   const Pose& shell_to_box) noexcept {
  const float radius = kStretch * sphere_radius(shell, 0);
  const Vec3 centre = Transform(shell_to_box).apply(sphere_centre(shell, 0));
  const Vec3 half = box.half_extents;
  const float x = std::abs(centre.x) - half.x;
  const float y = std::abs(centre.y) - half.y;
  const float z = std::abs(centre.z) - half.z;
  const float farthest = std::max({x, y, z});
  const float second = std::max(std::min(x, y), std::min(std::max(x, y), z));
  // V is the least distance from a face inside, and outside that from one if the other coordinates lie within.
  const auto faces = [&](float at, float half_up, Vec3 axis) -> std::optional<FacePair> {
    const float least = std::min(0.0F, std::max(farthest - radius, -half_up));
    if (!(second + radius <= least)) return {};
    return FacePair{{at < 0 ? -1.0F * axis : axis, half_up}, 2 * half_up};
  };
  if (z == farthest) return faces(centre.z, half.z, {0, 0, 1});
  if (y == farthest) return faces(centre.y, half.y, {0, 1, 0});
  return faces(centre.x, half.x, {1, 0, 0});
}

double largest_change(const PointshellView& shell, FieldRef field, const Pose& from, const Pose& to) noexcept {
  const auto normal = field.visit([&](const auto& kind) -> std::optional<Vec3> {
    using Kind = std::remove_cvref_t<decltype(kind)>;
    if constexpr (std::is_same_v<Kind, HalfSpaceField>) return kind.outward_normal;
    if constexpr (std::is_same_v<Kind, BoxField>) {
      const std::optional<FacePair> now = faces_near(kind, shell, to);
      if (!now) return {};
      const std::optional<FacePair> before = faces_near(kind, shell, from);
      if (before && dot(before->upper.outward_normal, now->upper.outward_normal) > 0) return now->upper.outward_normal;
    }
    return {};
  });
  return normal ? largest_displacement(shell, from, to, *normal) : largest_displacement(shell, from, to);
}

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Analytic fields point by point, and the parts that the vector kernels share. Internal.
#pragma once

#include <cmath>
#include <optional>

#include "runtime/vps_runtime.h"

namespace vps::detail {

/// By what a relative pose of two that check_pose accepts stretches a vector, or less: each by 1.0015.
inline constexpr float kStretch = 1.0031F;

/// `penetration` and `outward_normal` of each analytic field. A new field needs these two, its lanes
/// (fields/field_lanes-inl.h), and a place in KernelFields and in FieldRef.
float value_at(const BoxField& field, Vec3 point) noexcept;
float value_at(const SphereField& field, Vec3 point) noexcept;
float value_at(const HalfSpaceField& field, Vec3 point) noexcept;
float value_at(const RevolvedField& field, Vec3 point) noexcept;
float value_at(const PolytopeField& field, Vec3 point) noexcept;
Vec3 normal_at(const BoxField& field, Vec3 point) noexcept;
Vec3 normal_at(const SphereField& field, Vec3 point) noexcept;
Vec3 normal_at(const HalfSpaceField& field, Vec3 point) noexcept;
Vec3 normal_at(const RevolvedField& field, Vec3 point) noexcept;
Vec3 normal_at(const PolytopeField& field, Vec3 point) noexcept;

/// Two opposite faces of a box.
struct FacePair {
  HalfSpaceField upper;
  float distance = 0;  ///< [m]
};
/// The two faces of a box that give V at all points of a shell: the others are nearer to none of them.
std::optional<FacePair> faces_near(const BoxField& box, const PointshellView& shell, const Pose& shell_to_box) noexcept;

/// The side of a cone, in a plane through its axis: r is the distance from the axis, `down` that below the tip.
struct ConeSlant {
  float normal_r, normal_z;  ///< outward, unit: r and upwards
  float along_r, along_z;    ///< (r, down) times these: 0 at the tip, 1 at the rim
  explicit ConeSlant(const RevolvedField& cone) noexcept {
    const float height = 2 * cone.half_height;
    const float squared = cone.radius * cone.radius + height * height;
    const float size = std::sqrt(squared);
    normal_r = height / size;
    normal_z = cone.radius / size;
    along_r = cone.radius / squared;
    along_z = height / squared;
  }
};

}  // namespace vps::detail

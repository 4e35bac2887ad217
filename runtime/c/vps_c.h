// SPDX-License-Identifier: Zlib
/// @file Shared by the sources of the C interface: handles, conversions, checks of arguments. Internal.
#pragma once

#include <algorithm>
#include <cmath>

#include "runtime/vps.h"
#include "runtime/vps_contacts.h"
#include "runtime/vps_runtime.h"

struct VpsVoxelmap {
  vps::VoxelmapView view;
  const vps::PointshellView* shell = nullptr;  // of the same asset; null: it has none
};
struct VpsPointshell {
  vps::PointshellView view;
  std::vector<float> areas;  // of nodes
};
struct VpsAsset {
  vps::Asset asset;
  double scale = 1;
  VpsVoxelmap maps[4];  // by VpsField
  VpsPointshell shell;
};
struct VpsScratch {
  vps::Scratch scratch;
  std::vector<vps::Contact> contacts, kept;
  vps::ReductionScratch reduction;
  vps::StepScratch step;
  std::vector<vps::StepContact> step_contacts;
};
struct VpsContactCache {
  vps::ContactCache cache;
};
struct VpsStepMemory {
  vps::StepMemory memory;
};

namespace vps::c {

// No pair has more, and a large capacity is no reason to allocate.
inline constexpr size_t kMostStepContacts = 1024;

inline VpsStatus to_c(vps::Status status) {
  return status == vps::Status::no_memory ? VpsStatus{vps_no_memory} : static_cast<VpsStatus>(status);
}

inline bool is_finite(const float* v) {
  return v != nullptr && std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}
inline vps::Vec3 to_vec3(const float* v) {
  return {v[0], v[1], v[2]};
}
inline void copy(vps::Vec3 from, float* to) {
  to[0] = from.x;
  to[1] = from.y;
  to[2] = from.z;
}

inline vps::Pose to_pose(const VpsPose& from) {
  vps::Pose pose;
  std::copy_n(from.rotation, 9, pose.rotation);
  std::copy_n(from.translation, 3, pose.translation);
  return pose;
}

inline bool is_valid(const VpsBox& box) {
  return is_finite(box.half_extents) && std::min({box.half_extents[0], box.half_extents[1], box.half_extents[2]}) >= 0;
}
inline bool is_valid(const VpsSphere& sphere) {
  return std::isfinite(sphere.radius) && sphere.radius >= 0;
}
inline bool is_valid(const VpsHalfSpace& half_space) {
  const float* n = half_space.outward_normal;
  return is_finite(n) && std::isfinite(half_space.offset) && std::abs(std::hypot(n[0], n[1], n[2]) - 1) <= 1e-3F;
}
inline vps::BoxField to_cpp(const VpsBox& box) {
  return {to_vec3(box.half_extents)};
}
inline vps::SphereField to_cpp(const VpsSphere& sphere) {
  return {sphere.radius};
}
inline vps::HalfSpaceField to_cpp(const VpsHalfSpace& half_space) {
  return {to_vec3(half_space.outward_normal), half_space.offset};
}

// Checks a field of the C interface, converts it and calls run(FieldRef). Only this function lists all kinds.
template <class Run>
VpsStatus with_field(VpsFieldRef ref, const Run& run) {
  const auto convert = [&]<class Analytic>(const Analytic* field) -> VpsStatus {
    if (field == nullptr || !is_valid(*field)) return vps_bad_argument;
    return run(to_cpp(*field));
  };
  switch (ref.kind) {
    case vps_kind_map:
      return ref.field == nullptr ? VpsStatus{vps_bad_argument} : run(static_cast<const VpsVoxelmap*>(ref.field)->view);
    case vps_kind_box:
      return convert(static_cast<const VpsBox*>(ref.field));
    case vps_kind_sphere:
      return convert(static_cast<const VpsSphere*>(ref.field));
    case vps_kind_half_space:
      return convert(static_cast<const VpsHalfSpace*>(ref.field));
    default:
      return vps_bad_argument;
  }
}

// The points of a field's body; null: it has none.
inline const vps::PointshellView* shell_of(VpsFieldRef ref) {
  return ref.kind == vps_kind_map && ref.field != nullptr ? static_cast<const VpsVoxelmap*>(ref.field)->shell : nullptr;
}

}  // namespace vps::c

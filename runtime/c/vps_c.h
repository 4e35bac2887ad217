// SPDX-License-Identifier: Zlib
/// @file Shared by the sources of the C interface: handles, conversions, checks of arguments. Internal.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <span>
#include <vector>

#include "runtime/grow.h"
#include "runtime/vps.h"
#include "runtime/vps_contacts.h"
#include "runtime/vps_runtime.h"

struct VpsVoxelmap {
  vps::VoxelmapView view;
  const vps::PointshellView* shell = nullptr;  // of the same asset; null: it has none
};
struct VpsPointshell {
  vps::PointshellView view;

  // Areas of nodes, summed when they are first needed: that takes longer than to open an asset. Throws std::bad_alloc.
  [[nodiscard]] std::span<const float> areas() const {
    if (!has_areas_.load(std::memory_order_acquire)) {
      const std::lock_guard one_thread(summing_);
      if (!has_areas_.load(std::memory_order_relaxed)) {
        areas_.resize(view.nodes);
        (void)vps::node_areas(view, areas_);
        has_areas_.store(true, std::memory_order_release);
      }
    }
    return areas_;
  }
  void change_to(const vps::PointshellView& other) {
    view = other;
    has_areas_.store(false, std::memory_order_relaxed);
  }

 private:
  mutable std::mutex summing_;
  mutable std::atomic<bool> has_areas_{false};
  mutable std::vector<float> areas_;
};
struct VpsAsset {
  vps::Asset asset;
  double scale = 1;
  VpsVoxelmap maps[4];  // by VpsField
  VpsPointshell shell;
};
struct VpsScratch {
  vps::Scratch scratch;
  vps::detail::Room<vps::Contact> contacts, kept;
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

/// @param call  allocates
template <class Call>
VpsStatus or_no_memory(const Call& call) {
  return to_c(vps::detail::try_to_grow(call));
}
inline size_t most_contacts(const VpsPointshell& shell) {
  return size_t{shell.view.points} + shell.view.facets;
}
/// Makes room for a query.
inline VpsStatus reserve(VpsScratch* scratch, const VpsPointshell* shell, size_t capacity) {
  if (scratch == nullptr || shell == nullptr) return vps_bad_argument;
  return or_no_memory([&] {
    scratch->scratch.reserve(shell->view);
    (void)scratch->contacts.grow(std::min(capacity, most_contacts(*shell)));
  });
}

// Squares of larger lengths soon are infinite in single precision. [m]
inline constexpr float kFarthest = 1e15F;

template <class Number>
bool is_in_range(Number x) {
  return std::abs(x) <= kFarthest;
}
inline bool is_in_range(const float* v) {
  return v != nullptr && std::all_of(v, v + 3, [](float x) { return is_in_range(x); });
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
  return is_in_range(box.half_extents) &&
         std::min({box.half_extents[0], box.half_extents[1], box.half_extents[2]}) >= 0;
}
inline bool is_valid(const VpsSphere& sphere) {
  return sphere.radius >= 0 && sphere.radius <= kFarthest;
}
inline bool is_valid(const VpsHalfSpace& half_space) {
  const float* n = half_space.outward_normal;
  return is_in_range(n) && std::abs(half_space.offset) <= kFarthest &&
         std::abs(std::hypot(n[0], n[1], n[2]) - 1) <= 1e-3F;
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

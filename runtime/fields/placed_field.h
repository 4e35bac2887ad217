// SPDX-License-Identifier: Zlib
/// @file A field that is looked up at many places of another frame at once. Internal. Paper: Sec. 2.2.
#pragma once

#include <array>

#include "runtime/fields/place_field.h"

namespace vps::detail {

/// Up to kMost places, in rows as the kernels load them. What lies beyond `count` is not set.
struct Places {
  static constexpr std::size_t kMost = 5 * kLanePadding;  ///< whole vectors
  alignas(64) float x[kMost];
  alignas(64) float y[kMost];
  alignas(64) float z[kMost];
  std::uint32_t count = 0;
  void push(Vec3 p) noexcept {
    x[count] = p.x;
    y[count] = p.y;
    z[count++] = p.z;
  }
  [[nodiscard]] Vec3 operator[](std::size_t i) const noexcept { return {x[i], y[i], z[i]}; }
};

/// A value for each place.
using Values = std::array<float, Places::kMost>;

class PlacedField;

/// What a body looks like at places near it.
class FieldAtPlaces {
 public:
  virtual ~FieldAtPlaces() = default;
  /// V at each place. [m]
  virtual void penetrations(const Places& places, Values& out) const noexcept = 0;
  /// V of this body and of another at each place. [m]
  virtual void penetrations_beside(const PlacedField& other, const Places& places, Values& own,
                                   Values& others) const noexcept;

 protected:
  FieldAtPlaces() = default;
  FieldAtPlaces(const FieldAtPlaces&) = default;
  FieldAtPlaces& operator=(const FieldAtPlaces&) = default;
};

/// A field seen from another frame, looked up in vector lanes. It does not own the field.
class PlacedField final : public FieldAtPlaces {
 public:
  /// @param to_field  takes places to the field's frame
  PlacedField(FieldRef field, const Pose& to_field) noexcept;

  /// V at each place, as `penetration` gives it, within 1e-4 voxel; beyond the band a value that is no farther from 0.
  /// A map of layers is not supported. [m]
  void penetrations(const Places& places, Values& out) const noexcept override;
  /// The same values; two maps are read side by side.
  void penetrations_beside(const PlacedField& other, const Places& places, Values& own,
                           Values& others) const noexcept override;
  [[nodiscard]] float penetration(Vec3 place) const noexcept;

 private:
  FieldRef field_;
  Transform to_field_;
  /// The kernel; null for fields that are looked up one place after the other.
  void (*look_up_)(const void* field, const Affine& to_field, const Places& places, float* out) = nullptr;
  const void* analytic_ = nullptr;  ///< the kernel's field; null: `map_`
  SampledMap map_;
  Affine affine_{};
  float unit_ = 0;              ///< of the kernel. [m]
  bool has_small_map_ = false;  ///< `map_` has samples of 8 bits, as maps have by default
};

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
/// @file Fields in the form that the vector kernels use, and the place of a shell in a field. Internal.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <tuple>
#include <type_traits>

#include "formats/cell_plane.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {

/// Entries that a buffer for the kernels must have beyond its last used one.
inline constexpr std::uint32_t kLanePadding = 16;

/// For each mask of eight lanes the numbers of the lanes in it, one after the other.
inline constexpr auto kLanesOfMask = [] {
  std::array<std::array<std::uint8_t, 8>, 256> all{};
  for (std::size_t mask = 0; mask < all.size(); ++mask) {
    std::size_t count = 0;
    for (std::uint8_t lane = 0; lane < 8; ++lane) {
      if ((mask >> lane & 1) != 0) all[mask][count++] = lane;
    }
  }
  return all;
}();

/// p_field = rotation * p + translation, in the field's unit of length.
struct Affine {
  float rotation[9];  ///< row-major, with the unit's scale
  float translation[3];
};

/// A `scaled` field in voxels: point (0,0,0) is the centre of voxel (0,0,0).
struct SampledMap {
  const std::int32_t* roots = nullptr;
  const std::int32_t* nodes = nullptr;
  const void* values = nullptr;
  const std::int16_t* coarse_layers = nullptr;
  const std::int32_t* planes = nullptr;            ///< null: there are none
  std::int32_t root_dims[2] = {};                  ///< x, y; of the coarse layers, too
  float top[3] = {};                               ///< the last voxel's centre. [vx]
  std::uint32_t cells[3] = {};                     ///< between voxels' centres: `top`
  float bounds_min[3] = {}, bounds_max[3] = {};    ///< of the mesh. [vx]
  float band_inner = 0, band_outer = 0;            ///< [vx]
  float step = 0;                                  ///< lambda; bricks of level 1 have twice that. [vx]
  float error = 0;                                 ///< field_error. [vx]
  float certified_inner = 0, certified_outer = 0;  ///< certified_band. [vx]
  float end_inner = 0, end_outer = 0;              ///< end_of_band. [vx]
  // The far grid.
  const std::int8_t* far = nullptr;              ///< null: there is none
  std::int32_t far_dims[2] = {};                 ///< x, y
  float far_top[3] = {};                         ///< the last node, counted from the first
  float far_origin[3] = {};                      ///< the first node. [vx]
  float far_per_voxel = 0;                       ///< nodes in a voxel
  float far_step_inner = 0, far_step_outer = 0;  ///< of values above and below 0. [vx]
};

struct SampledMap8 : SampledMap {};   ///< samples of 8 bits
struct SampledMap16 : SampledMap {};  ///< samples of 16 bits

/// A voxelmap that is looked up one point after the other.
struct PlainMap {
  const VoxelmapView* map = nullptr;
  const float* rotation = nullptr;  ///< of the shell's normals, row-major
};

/// The solid -thickness <= z <= 0. `Affine` takes the shell to its frame.
struct SolidBelow {
  Vec3 up;  ///< z in the frame of the field that it stands for
  float thickness = std::numeric_limits<float>::infinity();
};

/// Every kind of field that the kernels know. Each has lanes: lanes_of in fields/field_lanes-inl.h.
using KernelFields =
    std::tuple<BoxField, SphereField, RevolvedField, PolytopeField, SolidBelow, PlainMap, SampledMap8, SampledMap16>;

/// Index of a kind in KernelFields. Other types do not compile.
template <class Field, std::size_t at = 0>
constexpr std::size_t kernel_kind() noexcept {
  if constexpr (std::is_same_v<Field, std::tuple_element_t<at, KernelFields>>) {
    return at;
  } else {
    return kernel_kind<Field, at + 1>();
  }
}

/// The relative pose in float: the difference of two double poses, so large world coordinates have cancelled.
struct Transform {
  float r[9];
  Vec3 t;
  explicit Transform(const Pose& pose) noexcept
      : t{static_cast<float>(pose.translation[0]), static_cast<float>(pose.translation[1]),
          static_cast<float>(pose.translation[2])} {
    for (int i = 0; i < 9; ++i) r[i] = static_cast<float>(pose.rotation[i]);
  }
  Vec3 rotate(Vec3 v) const noexcept {
    return {r[0] * v.x + r[1] * v.y + r[2] * v.z, r[3] * v.x + r[4] * v.y + r[5] * v.z,
            r[6] * v.x + r[7] * v.y + r[8] * v.z};
  }
  /// The inverse of `rotate`.
  Vec3 rotate_back(Vec3 v) const noexcept {
    return {r[0] * v.x + r[3] * v.y + r[6] * v.z, r[1] * v.x + r[4] * v.y + r[7] * v.z,
            r[2] * v.x + r[5] * v.y + r[8] * v.z};
  }
  Vec3 apply(Vec3 v) const noexcept { return rotate(v) + t; }
};

/// A field's own coordinates: p_field = (p - origin) / unit.
struct Frame {
  double origin[3] = {0, 0, 0};
  double unit = 1;
};

/// p -> ((pose p) - origin) / unit for p = start + scale q, computed in double.
inline Affine affine(const Pose& pose, const Frame& frame, const float (&start)[3], double scale) noexcept {
  Affine a;
  for (int i = 0; i < 3; ++i) {
    double at = pose.translation[i] - frame.origin[i];
    for (int k = 0; k < 3; ++k) {
      at += pose.rotation[3 * i + k] * start[k];
      a.rotation[3 * i + k] = static_cast<float>(pose.rotation[3 * i + k] * scale / frame.unit);
    }
    a.translation[i] = static_cast<float>(at / frame.unit);
  }
  return a;
}

/// Frame of a sampled map: in voxels, from the centre of voxel (0,0,0).
inline Frame voxel_frame(const VoxelmapView& map) noexcept {
  Frame frame;
  frame.unit = map.voxel_size;
  for (int axis = 0; axis < 3; ++axis) frame.origin[axis] = map.origin[axis] + 0.5 * frame.unit;
  return frame;
}

template <class Map>
Map sampled_map(const VoxelmapView& view, const Frame& frame) noexcept {
  Map map;
  map.roots = reinterpret_cast<const std::int32_t*>(view.field_roots);
  map.nodes = reinterpret_cast<const std::int32_t*>(view.field_nodes);
  map.values = view.values;
  map.coarse_layers = view.coarse_layers;
  map.planes = reinterpret_cast<const std::int32_t*>(view.planes);
  for (int axis = 0; axis < 3; ++axis) {
    map.cells[axis] = view.dims[axis] - 1;
    map.top[axis] = static_cast<float>(map.cells[axis]);
    map.bounds_min[axis] = static_cast<float>((view.bounds_min[axis] - frame.origin[axis]) / frame.unit);
    map.bounds_max[axis] = static_cast<float>((view.bounds_max[axis] - frame.origin[axis]) / frame.unit);
  }
  for (int axis = 0; axis < 2; ++axis) map.root_dims[axis] = static_cast<std::int32_t>(view.root_dims[axis]);
  map.band_inner = view.band_inner / view.voxel_size;
  map.band_outer = view.band_outer / view.voxel_size;
  map.step = view.lambda / view.voxel_size;
  map.error = field_error(view) / view.voxel_size;
  const CertifiedBand certified = certified_band(view);
  map.certified_inner = certified.inner / view.voxel_size;
  map.certified_outer = certified.outer / view.voxel_size;
  map.end_inner = end_of_band(view.band_inner, view.voxel_size) / view.voxel_size;
  map.end_outer = end_of_band(view.band_outer, view.voxel_size) / view.voxel_size;
  const FarGridView& far = view.far;
  map.far = far.values;
  if (map.far == nullptr) return map;
  for (int axis = 0; axis < 3; ++axis) {
    map.far_top[axis] = static_cast<float>(far.dims[axis] - 1);
    map.far_origin[axis] = static_cast<float>((far.origin[axis] - frame.origin[axis]) / frame.unit);
  }
  for (int axis = 0; axis < 2; ++axis) map.far_dims[axis] = static_cast<std::int32_t>(far.dims[axis]);
  map.far_per_voxel = static_cast<float>(frame.unit / double{far.spacing});
  map.far_step_inner = far.step_inner / view.voxel_size;
  map.far_step_outer = far.step_outer / view.voxel_size;
  return map;
}

/// The pose that takes a shell to SolidBelow instead of a half space. Only z = n . p - offset matters there.
inline Pose pose_above(const HalfSpaceField& field, const Pose& shell_to_field) noexcept {
  Pose down;
  const double n[3] = {field.outward_normal.x, field.outward_normal.y, field.outward_normal.z};
  down.translation[2] = -field.offset;
  for (int axis = 0; axis < 3; ++axis) {
    down.translation[2] += n[axis] * shell_to_field.translation[axis];
    down.rotation[6 + axis] = 0;
    for (int k = 0; k < 3; ++k) down.rotation[6 + axis] += n[k] * shell_to_field.rotation[3 * k + axis];
  }
  return down;
}

/// Calls run(field, frame, error [m], pose) with a field in the form that the kernels use. `pose` takes the shell to
/// that field. `error` is the field's error, which the kernel's upper bounds do not include.
template <class Run>
Status in_kernel_form(const VoxelmapView& map, const Pose& shell_to_map, const Run& run) noexcept {
  if (map.field == Field::scaled) {
    const Frame frame = voxel_frame(map);
    const float error = field_error(map);
    if (map.element == ElementType::i8) return run(sampled_map<SampledMap8>(map, frame), frame, error, shell_to_map);
    return run(sampled_map<SampledMap16>(map, frame), frame, error, shell_to_map);
  }
  float rotation[9];
  for (int i = 0; i < 9; ++i) rotation[i] = static_cast<float>(shell_to_map.rotation[i]);
  return run(PlainMap{&map, rotation}, Frame(), 0.0F, shell_to_map);
}
template <class Run>
Status in_kernel_form(const HalfSpaceField& field, const Pose& shell_to_field, const Run& run) noexcept {
  return run(SolidBelow{field.outward_normal}, Frame(), 0.0F, pose_above(field, shell_to_field));
}
/// The kernels use every other analytic field unchanged.
template <class Analytic, class Run>
Status in_kernel_form(const Analytic& field, const Pose& shell_to_field, const Run& run) noexcept {
  return run(field, Frame(), 0.0F, shell_to_field);
}

/// The same for all points of a shell. Of a box that reaches far beyond the shell only two faces count.
template <class Field, class Run>
Status in_kernel_form(const Field& field, const PointshellView& shell, const Pose& shell_to_field,
                      const Run& run) noexcept {
  if constexpr (std::is_same_v<Field, BoxField>) {
    if (const std::optional<FacePair> faces = faces_near(field, shell, shell_to_field)) {
      const SolidBelow solid{faces->upper.outward_normal, faces->distance};
      return run(solid, Frame(), 0.0F, pose_above(faces->upper, shell_to_field));
    }
  }
  return in_kernel_form(field, shell_to_field, run);
}

/// Largest rounding error of a shell's coordinates in a field, which grows with the shell's size and distance. In the
/// field's unit.
/// @param pose  takes the shell to the field
inline float rounding(const PointshellView& shell, const Pose& pose, const Frame& frame) noexcept {
  const Vec3 at = sphere_centre(shell, 0);
  const float centre[3] = {at.x, at.y, at.z};
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    largest = std::max(largest, std::abs(pose.translation[axis] - frame.origin[axis]) + std::abs(double{centre[axis]}));
  }
  constexpr double kRounding = 2e-6;
  return static_cast<float>(kRounding * (largest + double{sphere_radius(shell, 0)}) / frame.unit);
}

/// Upper bound of the distance that any place of a ball moves from one pose to the other. [m]
inline double largest_displacement(Vec3 at, float radius, const Pose& from, const Pose& to) noexcept {
  const double centre[3] = {at.x, at.y, at.z};
  double turned = 0;
  double moved = 0;
  for (int i = 0; i < 3; ++i) {
    double along = to.translation[i] - from.translation[i];
    for (int k = 0; k < 3; ++k) {
      const double change = to.rotation[3 * i + k] - from.rotation[3 * i + k];
      along += change * centre[k];
      turned += change * change;
    }
    moved += along * along;
  }
  // The difference of two rotations stretches a vector by its Frobenius norm over sqrt(2).
  constexpr double kRounding = 1 + 1e-6;
  return kRounding * (std::sqrt(moved) + std::sqrt(turned / 2) * double{radius});
}
/// The same for all points of a shell. [m]
inline double largest_displacement(const PointshellView& shell, const Pose& from, const Pose& to) noexcept {
  return largest_displacement(sphere_centre(shell, 0), sphere_radius(shell, 0), from, to);
}

/// The same along a unit vector of the poses' frame. [m]
inline double largest_displacement(const PointshellView& shell, const Pose& from, const Pose& to, Vec3 along) noexcept {
  const Vec3 at = sphere_centre(shell, 0);
  const double centre[3] = {at.x, at.y, at.z};
  const double axis[3] = {along.x, along.y, along.z};
  double moved = 0;
  double turned = 0;
  for (int i = 0; i < 3; ++i) moved += axis[i] * (to.translation[i] - from.translation[i]);
  for (int k = 0; k < 3; ++k) {
    double change = 0;
    for (int i = 0; i < 3; ++i) change += axis[i] * (to.rotation[3 * i + k] - from.rotation[3 * i + k]);
    moved += change * centre[k];
    turned += change * change;
  }
  constexpr double kRounding = 1 + 1e-6;
  return kRounding * (std::abs(moved) + std::sqrt(turned) * sphere_radius(shell, 0));
}

/// Upper bound of what V at any point of the shell changes by from one pose to the other. A body that slides along a
/// plane, or along a face of a box that is wider than the shell, comes no closer to it. [m]
double largest_change(const PointshellView& shell, FieldRef field, const Pose& from, const Pose& to) noexcept;

}  // namespace vps::detail

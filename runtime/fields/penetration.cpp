// SPDX-License-Identifier: Zlib
// The public point queries. Paper: Sec. 2.2.
#include "runtime/fields/penetration.h"

#include <cstdlib>

#include "runtime/fields/analytic_fields.h"

namespace vps {
namespace {

using detail::operator*;
using detail::operator-;

// The vector with unit length; zero where it is shorter than `least`.
Vec3 unit_above(float least, Vec3 v) noexcept {
  const float size = detail::length(v);
  return size > least ? (1 / size) * v : Vec3();
}

// Decrease of the layers along each axis from `low` to `high`, the neighbours of a place in a grid of this shape.
// Neighbours beyond the grid are replaced by the nearest place in it.
template <class Layer>
void layer_slopes(const std::int64_t (&at)[3], const std::uint32_t (&shape)[3], Layer layer, float (&out)[3]) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int64_t low[3] = {at[0], at[1], at[2]};
    std::int64_t high[3] = {at[0], at[1], at[2]};
    low[axis] = std::max<std::int64_t>(at[axis] - 1, 0);
    high[axis] = std::min<std::int64_t>(at[axis] + 1, shape[axis] - 1);
    out[axis] = layer(low) - layer(high);
  }
}

// Normal without samples: from the layers of the neighbouring voxels or, where no layers are stored, from those of the
// neighbouring blocks.
Vec3 normal_from_layers(const VoxelmapView& map, Vec3 point) noexcept {
  const detail::Voxel found = detail::find_voxel(map, point);
  if (!found.in_grid) return {};
  const auto place_of = [](std::size_t number, const std::uint32_t(&dims)[3]) {
    const auto n = static_cast<std::int64_t>(number);
    return std::array<std::int64_t, 3>{n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]};
  };
  const auto number_of = [](const std::array<std::int64_t, 3>& at, const std::uint32_t(&dims)[3]) {
    return static_cast<std::size_t>((at[2] * dims[1] + at[1]) * dims[0] + at[0]);
  };
  float out[3];
  if (map.field == Field::layers && detail::has_layer(map, found)) {
    constexpr std::int64_t kEdge = kBrickEdge;
    const std::array<std::int64_t, 3> brick = place_of(found.brick, map.brick_dims);
    const auto v = static_cast<std::int64_t>(found.voxel);
    const std::int64_t voxel[3] = {brick[0] * kEdge + v % kEdge, brick[1] * kEdge + v / kEdge % kEdge,
                                   brick[2] * kEdge + v / (kEdge * kEdge)};
    const auto own = static_cast<float>(detail::layer_of(map, found));
    layer_slopes(
        voxel, map.dims,
        [&](const std::int64_t(&at)[3]) {
          detail::Voxel other;
          other.in_grid = true;
          other.brick = number_of({at[0] / kEdge, at[1] / kEdge, at[2] / kEdge}, map.brick_dims);
          other.voxel = static_cast<std::size_t>(((at[2] % kEdge) * kEdge + at[1] % kEdge) * kEdge + at[0] % kEdge);
          if (detail::has_layer(map, other)) return static_cast<float>(detail::layer_of(map, other));
          return map.brick_index[other.brick] == kNoBrickInside ? own + 1 : own - 1;  // away from the surface
        },
        out);
  } else {
    const std::array<std::int64_t, 3> block = place_of(found.block, map.root_dims);
    layer_slopes(
        {block[0], block[1], block[2]}, map.root_dims,
        [&](const std::int64_t(&at)[3]) {
          return static_cast<float>(map.coarse_layers[number_of({at[0], at[1], at[2]}, map.root_dims)]);
        },
        out);
  }
  return unit_above(0.5F, {out[0], out[1], out[2]});
}

// Normal beyond the samples of the band: from the far grid, the coarse layers or the mesh's bounds.
Vec3 normal_beyond(const VoxelmapView& map, Vec3 point) noexcept {
  const FarGridView& far = map.far;
  const detail::FarCell cell = detail::find_far_cell(far, point);
  if (cell.in_grid && detail::far_value(cell) > detail::farthest_value(far) + far.step_outer) {
    const Vec3 fall = detail::trilinear_fall(cell.corners, cell.part, far.spacing);
    // Cells on a ridge of the field have less slope. One with less than the samples' rounding has none.
    const Vec3 out = unit_above(0.5F * std::max(far.step_inner, far.step_outer) / far.spacing, fall);
    if (detail::dot(out, out) > 0) return out;
  }
  const Vec3 estimate = normal_from_layers(map, point);
  if (detail::dot(estimate, estimate) > 0) return estimate;
  const float* const low = map.bounds_min;
  const float* const high = map.bounds_max;
  const Vec3 nearest{std::clamp(point.x, low[0], high[0]), std::clamp(point.y, low[1], high[1]),
                     std::clamp(point.z, low[2], high[2])};
  return unit_above(0, point - nearest);
}

// Minus the gradient of V between the samples of a field brick.
Vec3 sampled_fall(const VoxelmapView& map, const detail::FieldCell& cell) noexcept {
  if (map.field != Field::real) {
    float v[8];
    detail::corner_values(map, cell, v);
    return detail::trilinear_fall(v, cell.part, cell.edge);
  }
  float out[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float v[8];
    for (std::size_t corner = 0; corner < 8; ++corner) {
      v[corner] = map.gradients[3 * cell.corners.number(corner) + axis];
    }
    out[axis] = -map.scale * detail::trilinear(v, cell.part) / map.voxel_size;
  }
  return {out[0], out[1], out[2]};
}

// Minus the gradient of V over a voxel.
Vec3 fall_over_voxel(const VoxelmapView& map, Vec3 p) noexcept {
  const float h = 0.5F * map.voxel_size;
  const auto rise = [&](Vec3 step) {
    const Vec3 low{p.x - step.x, p.y - step.y, p.z - step.z};
    const Vec3 high{p.x + step.x, p.y + step.y, p.z + step.z};
    return (detail::voxelmap_penetration(map, high, {}) - detail::voxelmap_penetration(map, low, {})) / (2 * h);
  };
  return {-rise({h, 0, 0}), -rise({0, h, 0}), -rise({0, 0, h})};
}

// Normal between the samples of a field brick.
Vec3 normal_in_cell(const VoxelmapView& map, Vec3 point, const detail::FieldCell& cell) noexcept {
  // A distance field has slope 1 except on its ridges. Clamped samples make it less.
  const Vec3 fall = sampled_fall(map, cell);
  // Stored gradients were not checked: those that are no numbers have none.
  const float stored = detail::length(fall);
  const float slope = std::isfinite(stored) ? stored : 0;
  constexpr float kWhole = 0.9F;
  if (slope > kWhole) return (1 / slope) * fall;
  const float v = detail::interpolate(map, cell);
  if (std::abs(v) >= detail::end_of_band(v >= 0 ? map.band_inner : map.band_outer, map.voxel_size)) {
    const Vec3 beyond = normal_beyond(map, point);
    if (detail::dot(beyond, beyond) > 0) return beyond;
  }
  // On a ridge the sides of a whole voxel decide. Less is the samples' rounding.
  const Vec3 wide = slope > 0.5F ? fall : fall_over_voxel(map, point);
  return unit_above(2 * map.lambda / cell.edge, wide);
}

float value_in(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  return detail::voxelmap_penetration(map, point, inward_normal);
}
template <class Analytic>
float value_in(const Analytic& field, Vec3 point, Vec3 /*inward_normal*/) noexcept {
  return detail::value_at(field, point);
}

}  // namespace

Vec3 detail::normal_at(const VoxelmapView& map, Vec3 point) noexcept {
  if (map.field == Field::layers) {
    const Voxel found = find_voxel(map, point);
    if (!has_layer(map, found)) return normal_beyond(map, point);
    const Vec3 estimate = normal_from_layers(map, point);
    return dot(estimate, estimate) > 0 ? estimate : normal_beyond(map, point);
  }
  const FieldCell cell = find_cell(map, point);
  return octree::is_brick(cell.entry) ? normal_in_cell(map, point, cell) : normal_beyond(map, point);
}

detail::PenetrationAndNormal detail::penetration_and_normal(const VoxelmapView& map, Vec3 point) noexcept {
  if (map.field != Field::layers) {
    const FieldCell cell = find_cell(map, point);
    if (octree::is_brick(cell.entry)) {
      return {with_far_grid(map, point, {interpolate(map, cell), true}), normal_in_cell(map, point, cell)};
    }
  }
  const Vec3 normal = normal_at(map, point);
  return {voxelmap_penetration(map, point, normal), normal};
}

float penetration(FieldRef field, Vec3 point, Vec3 inward_normal) noexcept {
  return field.visit([&](const auto& kind) { return value_in(kind, point, inward_normal); });
}
Vec3 outward_normal(FieldRef field, Vec3 point) noexcept {
  return field.visit([point](const auto& kind) { return detail::normal_at(kind, point); });
}
float penetration_bound(const VoxelmapView& map, Vec3 point) noexcept {
  return detail::voxelmap_bound(map, point);
}

}  // namespace vps

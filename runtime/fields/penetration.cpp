// SPDX-License-Identifier: Zlib
// The public point queries. Paper: Sec. 2.2.
#include "runtime/fields/penetration.h"

#include <cstdlib>

#include "runtime/fields/analytic_fields.h"

namespace vps {
namespace {

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
// neighbouring bricks.
Vec3 normal_from_layers(const VoxelmapView& map, Vec3 point) noexcept {
  const detail::Voxel found = detail::find_voxel(map, point);
  if (!found.in_grid) return {};
  const auto brick_at = [&](const std::int64_t(&b)[3]) {
    return static_cast<std::size_t>((b[2] * map.brick_dims[1] + b[1]) * map.brick_dims[0] + b[0]);
  };
  constexpr std::int64_t kEdge = kBrickEdge;
  const auto b = static_cast<std::int64_t>(found.brick);
  const std::int64_t brick[3] = {b % map.brick_dims[0], b / map.brick_dims[0] % map.brick_dims[1],
                                 b / map.brick_dims[0] / map.brick_dims[1]};
  float out[3];
  float least = kBrickEdge;  // half of the decrease of a distance over two bricks
  if (map.field == Field::layers && map.brick_index[found.brick] != kNoBrick) {
    const auto v = static_cast<std::int64_t>(found.voxel);
    const std::int64_t voxel[3] = {brick[0] * kEdge + v % kEdge, brick[1] * kEdge + v / kEdge % kEdge,
                                   brick[2] * kEdge + v / (kEdge * kEdge)};
    layer_slopes(
        voxel, map.dims,
        [&](const std::int64_t(&at)[3]) {
          detail::Voxel other;
          other.brick = brick_at({at[0] / kEdge, at[1] / kEdge, at[2] / kEdge});
          other.voxel = static_cast<std::size_t>(((at[2] % kEdge) * kEdge + at[1] % kEdge) * kEdge + at[0] % kEdge);
          if (map.brick_index[other.brick] == kNoBrick) return static_cast<float>(map.coarse_layers[other.brick]);
          return static_cast<float>(detail::layer_of(map, other));
        },
        out);
    least = 1;
  } else {
    layer_slopes(
        brick, map.brick_dims,
        [&](const std::int64_t(&at)[3]) { return static_cast<float>(map.coarse_layers[brick_at(at)]); }, out);
  }
  const float slope = detail::length({out[0], out[1], out[2]});
  if (!(slope >= least)) return {};
  return {out[0] / slope, out[1] / slope, out[2] / slope};
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
  if (map.field == Field::layers) return normal_from_layers(map, point);
  const detail::FieldCell cell = detail::find_cell(map, point);
  if (!octree::is_brick(cell.entry)) return normal_from_layers(map, point);
  float out[3];
  if (map.field == Field::real) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      float sum = 0;
      for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::size_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
        float weight = 1;
        for (std::size_t k = 0; k < 3; ++k) weight *= d[k] != 0 ? cell.part[k] : 1 - cell.part[k];
        sum += weight * map.gradients[3 * (cell.first + (d[2] * kFieldEdge + d[1]) * kFieldEdge + d[0]) + axis];
      }
      out[axis] = -sum / map.voxel_size;
    }
  } else {
    // The gradient of the interpolation.
    float v[8];
    detail::corner_values(map, cell, v);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = std::size_t{1} << axis;
      const std::size_t a = (axis + 1) % 3;
      const std::size_t b = (axis + 2) % 3;
      const auto rise = [&](std::size_t along_a, std::size_t along_b) {
        const std::size_t low = along_a << a | along_b << b;
        return v[low | step] - v[low];
      };
      out[axis] = -detail::mix(detail::mix(rise(0, 0), rise(1, 0), cell.part[a]),
                               detail::mix(rise(0, 1), rise(1, 1), cell.part[a]), cell.part[b]) /
                  cell.edge;
    }
  }
  const float slope = detail::length({out[0], out[1], out[2]});
  constexpr float kLeastSlope = 0.5F;  // a distance field has slope 1 except on its ridges
  if (!(slope > kLeastSlope)) return {};
  return {out[0] / slope, out[1] / slope, out[2] / slope};
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

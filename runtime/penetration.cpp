// SPDX-License-Identifier: Zlib
// The public point queries. Paper: Sec. 2.2.
#include "runtime/penetration.h"

namespace vps {
namespace {

// V at the centre of a voxel: stored, or the band's end where the brick is not.
float centre_value(const VoxelmapView& map, const std::int64_t (&index)[3]) noexcept {
  for (int axis = 0; axis < 3; ++axis) {
    if (index[axis] < 0 || index[axis] >= map.dims[axis]) return -map.band_outer;
  }
  constexpr std::int64_t kEdge = kBrickEdge;
  detail::Cell cell;
  cell.brick = static_cast<std::size_t>(
      ((index[2] / kEdge) * map.brick_dims[1] + index[1] / kEdge) * map.brick_dims[0] + index[0] / kEdge);
  cell.slot = map.brick_index[cell.brick];
  if (cell.slot == kNoBrick) return map.coarse_layers[cell.brick] > 0 ? map.band_inner : -map.band_outer;
  cell.voxel = static_cast<std::size_t>(((index[2] % kEdge) * kEdge + index[1] % kEdge) * kEdge + index[0] % kEdge);
  const float sigma = map.field == Field::layers ? map.voxel_size : map.lambda;
  return static_cast<float>(detail::integer_value(map, cell)) * sigma;
}

}  // namespace

Vec3 outward_normal(const VoxelmapView& map, Vec3 point) noexcept {
  const detail::Cell cell = detail::locate(map, point);
  if (!cell.in_grid || cell.slot == kNoBrick) return {};
  float out[3];
  if (map.field == Field::real) {
    const float* const g = map.gradients + 3 * (std::size_t{cell.slot} * kBrickVoxels + cell.voxel);
    for (int axis = 0; axis < 3; ++axis) out[axis] = -g[axis] / map.voxel_size;
  } else {
    const float p[3] = {point.x, point.y, point.z};
    for (int axis = 0; axis < 3; ++axis) {
      std::int64_t low[3];
      std::int64_t high[3];
      for (int k = 0; k < 3; ++k) {
        // As in locate, so that both mean the same voxel.
        low[k] = high[k] = static_cast<std::int64_t>(static_cast<float>(p[k] - map.origin[k]) / map.voxel_size);
      }
      --low[axis];
      ++high[axis];
      out[axis] = (centre_value(map, low) - centre_value(map, high)) / (2 * map.voxel_size);
    }
  }
  const float slope = detail::length({out[0], out[1], out[2]});
  constexpr float kLeastSlope = 0.5F;  // a distance field has slope 1 but on its ridges
  if (!(slope > kLeastSlope)) return {};
  return {out[0] / slope, out[1] / slope, out[2] / slope};
}

float penetration(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  return detail::voxelmap_penetration(map, point, inward_normal);
}
float penetration_bound(const VoxelmapView& map, Vec3 point) noexcept {
  return detail::voxelmap_bound(map, point);
}
float penetration(const BoxField& field, Vec3 point) noexcept {
  return detail::box_penetration(field, point);
}
float penetration(const SphereField& field, Vec3 point) noexcept {
  return detail::sphere_penetration(field, point);
}
float penetration(const HalfSpaceField& field, Vec3 point) noexcept {
  return detail::half_space_penetration(field, point);
}

}  // namespace vps

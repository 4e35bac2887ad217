// SPDX-License-Identifier: Zlib
/// @file Point lookups in a voxelmap and in the analytic fields, inline for the traverse. Paper: Sec. 2.2. Internal.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps::detail {

inline Vec3 operator+(Vec3 a, Vec3 b) noexcept {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) noexcept {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline float dot(Vec3 a, Vec3 b) noexcept {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline float length(Vec3 a) noexcept {
  return std::sqrt(dot(a, a));
}

/// Where a point lies in the grid.
struct Cell {
  bool in_grid = false;
  std::size_t brick = 0;          ///< position in brick_index
  std::uint32_t slot = kNoBrick;  ///< number of the stored brick
  std::size_t voxel = 0;          ///< position inside the brick
  Vec3 to_centre;                 ///< e = C - P of Eq. (4), C the voxel's centre. [m]
  Vec3 to_brick_centre;           ///< [m]
};

inline Cell locate(const VoxelmapView& map, Vec3 point) noexcept {
  Cell cell;
  const float p[3] = {point.x, point.y, point.z};
  std::uint32_t index[3];
  float to_centre[3];
  float to_brick_centre[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto local = static_cast<float>(p[axis] - map.origin[axis]);
    const float grid = local / map.voxel_size;
    // Written so that NaN counts as outside.
    if (!(grid >= 0.0F && grid < static_cast<float>(map.dims[axis]))) return cell;
    index[axis] = static_cast<std::uint32_t>(grid);
    to_centre[axis] = (static_cast<float>(index[axis]) + 0.5F) * map.voxel_size - local;
    to_brick_centre[axis] =
        static_cast<float>((index[axis] & ~(kBrickEdge - 1)) + kBrickEdge / 2) * map.voxel_size - local;
  }
  cell.in_grid = true;
  const std::size_t bx = index[0] / kBrickEdge;
  const std::size_t by = index[1] / kBrickEdge;
  const std::size_t bz = index[2] / kBrickEdge;
  cell.brick = (bz * map.brick_dims[1] + by) * map.brick_dims[0] + bx;
  cell.slot = map.brick_index[cell.brick];
  constexpr std::uint32_t kMask = kBrickEdge - 1;
  cell.voxel = ((index[2] & kMask) * kBrickEdge + (index[1] & kMask)) * kBrickEdge + (index[0] & kMask);
  cell.to_centre = {to_centre[0], to_centre[1], to_centre[2]};
  cell.to_brick_centre = {to_brick_centre[0], to_brick_centre[1], to_brick_centre[2]};
  return cell;
}

/// The stored integer of a voxel in a stored brick.
inline std::int32_t integer_value(const VoxelmapView& map, const Cell& cell) noexcept {
  const std::size_t at = std::size_t{cell.slot} * kBrickVoxels + cell.voxel;
  switch (map.element) {
    case ElementType::i8:
      return static_cast<const std::int8_t*>(map.values)[at];
    case ElementType::i16:
      return static_cast<const std::int16_t*>(map.values)[at];
    default:
      return static_cast<const std::int32_t*>(map.values)[at];
  }
}

/// Distance from a point outside the mesh's bounding box to that box; 0 inside. [m]
inline float distance_to_bounds(const VoxelmapView& map, Vec3 point) noexcept {
  const float p[3] = {point.x, point.y, point.z};
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float gap = std::max({map.bounds_min[axis] - p[axis], p[axis] - map.bounds_max[axis], 0.0F});
    sum += gap * gap;
  }
  return std::sqrt(sum);
}

/// Interval of the true penetration in a brick that is not stored: the coarse layer at the brick's centre, which is up
/// to three voxels below the distance, moved to the point by the triangle inequality (a distance field is 1-Lipschitz),
/// and the band that the brick lies outside of.
struct Interval {
  float low, high;
};
inline Interval far_interval(const VoxelmapView& map, const Cell& cell) noexcept {
  const auto layer = static_cast<float>(map.coarse_layers[cell.brick]);
  const float reach = length(cell.to_brick_centre);
  const float slack = length(cell.to_centre);
  const float s = map.voxel_size;
  if (layer > 0) return {std::max(layer * s - reach, map.band_inner - slack), (layer + kCoarseLayerSlack) * s + reach};
  return {(layer - kCoarseLayerSlack) * s - reach, std::min(layer * s + reach, slack - map.band_outer)};
}

/// V(P). Paper: Eqs. (4) and (5), Sec. 2.2.
inline float voxelmap_penetration(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  const Cell cell = locate(map, point);
  if (!cell.in_grid) return -distance_to_bounds(map, point);
  if (cell.slot == kNoBrick) {
    const Interval v = far_interval(map, cell);
    return map.coarse_layers[cell.brick] > 0 ? v.low : v.high;
  }
  if (map.field == Field::real) {
    const std::size_t at = std::size_t{cell.slot} * kBrickVoxels + cell.voxel;
    const float* const g = map.gradients + 3 * at;
    // Eq. (5); the gradient is metres per voxel step, hence the division by s.
    return static_cast<float>(static_cast<const double*>(map.values)[at]) -
           dot({g[0], g[1], g[2]}, cell.to_centre) / map.voxel_size;
  }
  const float sigma = map.field == Field::layers ? map.voxel_size : map.lambda;
  const float local = dot(inward_normal, cell.to_centre);
  return local + static_cast<float>(integer_value(map, cell)) * sigma;
}

/// Upper bound of the true penetration.
inline float voxelmap_bound(const VoxelmapView& map, Vec3 point) noexcept {
  const Cell cell = locate(map, point);
  if (!cell.in_grid) return -distance_to_bounds(map, point);
  if (cell.slot == kNoBrick) return far_interval(map, cell).high;
  const float slack = length(cell.to_centre);
  if (map.field == Field::real) {
    const std::size_t at = std::size_t{cell.slot} * kBrickVoxels + cell.voxel;
    const auto value = static_cast<float>(static_cast<const double*>(map.values)[at]);
    return value >= map.band_inner ? std::numeric_limits<float>::max() : value + slack;
  }
  const auto value = static_cast<float>(integer_value(map, cell));
  if (map.field == Field::scaled) {
    // Rounded to the nearest multiple of lambda, and clamped beyond the band.
    return value * map.lambda >= map.band_inner - map.lambda ? std::numeric_limits<float>::max()
                                                             : (value + 0.5F) * map.lambda + slack;
  }
  // A voxel of Chebyshev layer -n is separated from every surface voxel by n - 1 whole voxels along some axis.
  return value < 0 ? (value + 1) * map.voxel_size : std::numeric_limits<float>::max();
}

inline float box_penetration(const BoxField& box, Vec3 p) noexcept {
  const Vec3 q{std::abs(p.x) - box.half_extents.x, std::abs(p.y) - box.half_extents.y,
               std::abs(p.z) - box.half_extents.z};
  const Vec3 outside{std::max(q.x, 0.0F), std::max(q.y, 0.0F), std::max(q.z, 0.0F)};
  return -length(outside) - std::min(std::max({q.x, q.y, q.z}), 0.0F);
}

inline float sphere_penetration(const SphereField& sphere, Vec3 p) noexcept {
  return sphere.radius - length(p);
}

inline float half_space_penetration(const HalfSpaceField& plane, Vec3 p) noexcept {
  return plane.offset - dot(plane.outward_normal, p);
}

}  // namespace vps::detail

// SPDX-License-Identifier: Zlib
// Walks from a point to the surface of a sampled field.
#include <cmath>

#include "runtime/penetration.h"
#include "runtime/vps_queries.h"

namespace vps {
namespace {

using namespace detail;

Vec3 scaled(Vec3 a, float by) noexcept {
  return {a.x * by, a.y * by, a.z * by};
}

class Walk {
 public:
  Walk(const VoxelmapView& map, const ClosestPointOptions& options) noexcept
      : map_(map), tolerance_(options.tolerance_vx * map.voxel_size), left_(options.max_iterations) {}

  // Newton steps where there are samples; before, steps in which no surface is passed, towards it by the layers.
  bool to_surface(Vec3& at, float& residual) noexcept {
    for (; left_ > 0; --left_) {
      const FieldCell cell = find_cell(map_, at);
      float v = 0;
      if (cell.entry < kNodeFlag) {
        v = interpolate(map_, cell);
        residual = std::abs(v);
        if (residual <= tolerance_) return true;
      } else if (!cell.in_grid) {
        const Vec3 nearest = in_bounds(at);
        if (nearest.x == at.x && nearest.y == at.y && nearest.z == at.z) return false;
        at = nearest;
        continue;
      } else {
        const Interval depth = depth_interval(map_, at);
        const float least = 0.5F * map_.voxel_size;
        v = cell.entry == kFarInside ? std::max(depth.low, least) : std::min(depth.high, -least);
      }
      const Vec3 normal = outward_normal(map_, at);
      if (dot(normal, normal) == 0) return false;
      at = at + scaled(normal, v);
    }
    return false;
  }

 private:
  Vec3 in_bounds(Vec3 p) const noexcept {
    const float* const low = map_.bounds_min;
    const float* const high = map_.bounds_max;
    return {std::clamp(p.x, low[0], high[0]), std::clamp(p.y, low[1], high[1]), std::clamp(p.z, low[2], high[2])};
  }

  const VoxelmapView& map_;
  const float tolerance_;
  std::uint32_t left_;
};

// The closest point's normal leads to the point asked for: from a place on the surface to the foot of the point on its
// tangent plane, and back to the surface, while that brings it nearer.
void slide(const VoxelmapView& map, Vec3 point, Walk& walk, ClosestPoint& result) noexcept {
  const float least_gain = 1e-3F * map.voxel_size;
  float part = 1;
  constexpr float kLeastPart = 0.2F;
  while (part > kLeastPart) {
    const Vec3 n = outward_normal(map, result.position);
    if (dot(n, n) == 0) return;
    const Vec3 to_point = point - result.position;
    Vec3 next = result.position + scaled(to_point - scaled(n, dot(to_point, n)), part);
    float residual = 0;
    if (!walk.to_surface(next, residual)) return;
    const float distance = length(point - next);
    if (!(distance < result.distance - least_gain)) {
      part /= 2;
      continue;
    }
    result.position = next;
    result.distance = distance;
    result.residual = residual;
  }
}

}  // namespace

Status closest_point(const VoxelmapView& map, Vec3 point, const ClosestPointOptions& options,
                     ClosestPoint& result) noexcept {
  result = {};
  if (map.field == Field::none || map.field == Field::layers) return Status::missing_part;
  constexpr float kFarthest = 1e15F;  // squares of it are floats
  if (!(std::max({std::abs(point.x), std::abs(point.y), std::abs(point.z)}) <= kFarthest)) return Status::bad_argument;
  if (!(options.tolerance_vx > 0 && std::isfinite(options.tolerance_vx)) || options.max_iterations == 0) {
    return Status::bad_argument;
  }
  const Interval depth = depth_interval(map, point);
  // Float coordinates are rounded, and so are differences of them.
  const float rounding = 1e-6F * (std::abs(point.x) + std::abs(point.y) + std::abs(point.z));
  result.inside = depth.low + depth.high >= 0;
  result.lower = std::max(std::max(depth.low, -depth.high) - rounding, 0.0F);
  result.upper = std::max(std::abs(depth.low), std::abs(depth.high)) + rounding;

  Walk walk(map, options);
  result.position = point;
  result.converged = walk.to_surface(result.position, result.residual);
  result.distance = length(point - result.position);
  if (!result.converged) return Status::ok;
  slide(map, point, walk, result);
  result.outward_normal = outward_normal(map, result.position);
  const Interval there = depth_interval(map, result.position);
  result.upper =
      std::min(result.upper, result.distance + std::max(std::abs(there.low), std::abs(there.high)) + rounding);
  return Status::ok;
}

}  // namespace vps

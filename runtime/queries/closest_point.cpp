// SPDX-License-Identifier: Zlib
// Walks from a point to the surface of a sampled field.
#include "runtime/queries/closest_point.h"

#include <cmath>

#include "runtime/fields/penetration.h"

namespace vps {
namespace {

using namespace detail;

Vec3 scaled(Vec3 a, float by) noexcept {
  return {a.x * by, a.y * by, a.z * by};
}

class SurfaceWalk {
 public:
  SurfaceWalk(const VoxelmapView& map, const ClosestPointOptions& options) noexcept
      : map_(map), tolerance_(options.tolerance_vx * map.voxel_size), left_(options.max_iterations) {}

  // Takes Newton steps where there are samples, and in the far grid while it comes nearer. Elsewhere it goes from block
  // to block towards the surface.
  bool to_surface(Vec3& at, float& residual) noexcept {
    constexpr float kNearer = 0.75F;
    float nearest = std::numeric_limits<float>::max();
    for (; left_ > 0; --left_) {
      const FieldCell cell = find_cell(map_, at);
      const bool sampled = octree::is_brick(cell.entry);
      const float v = sampled ? interpolate(map_, cell) : voxelmap_penetration(map_, at, {});
      residual = std::abs(v);
      if (sampled && residual <= tolerance_) return true;
      const bool steps = sampled || (residual < kNearer * nearest && find_far_cell(map_.far, at).in_grid);
      if (!sampled) nearest = std::min(nearest, residual);
      const Vec3 normal = steps ? normal_at(map_, at) : Vec3();
      if (dot(normal, normal) > 0) {
        at = at + scaled(normal, v);
      } else if (!approach(at, sampled ? residual : std::numeric_limits<float>::max())) {
        return false;
      }
    }
    return false;
  }

 private:
  // For points without a slope to follow, as beyond the band. Goes into the mesh's bounds, to a block nearer to the
  // surface by its layer, or to a sample with |V| less than `residual`. False where there is no such place.
  bool approach(Vec3& at, float residual) const noexcept {
    const float* const low = map_.bounds_min;
    const float* const high = map_.bounds_max;
    const Vec3 nearest{std::clamp(at.x, low[0], high[0]), std::clamp(at.y, low[1], high[1]),
                       std::clamp(at.z, low[2], high[2])};
    if (length(nearest - at) > 0) {
      at = nearest;
      return true;
    }
    return to_nearer_block(at) || to_smaller_sample(at, residual);
  }

  bool to_nearer_block(Vec3& at) const noexcept {
    const Voxel found = find_voxel(map_, at);
    if (!found.in_grid) return false;
    std::int64_t block[3];
    auto rest = static_cast<std::int64_t>(found.block);
    for (int axis = 0; axis < 3; ++axis) {
      block[axis] = rest % map_.root_dims[axis];
      rest /= map_.root_dims[axis];
    }
    int least = std::abs(map_.coarse_layers[found.block]);
    float way = 0;  // to the best block so far; 0: blocks with the same layer as the point's own are not better
    Vec3 next = at;
    for_each_neighbour([&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const std::int64_t b[3] = {block[0] + x, block[1] + y, block[2] + z};
      for (int axis = 0; axis < 3; ++axis) {
        if (b[axis] < 0 || b[axis] >= map_.root_dims[axis]) return;
      }
      const auto number = static_cast<std::size_t>((b[2] * map_.root_dims[1] + b[1]) * map_.root_dims[0] + b[0]);
      const int layer = std::abs(map_.coarse_layers[number]);
      const Vec3 centre = at + found.to_block_centre +
                          scaled({float(x), float(y), float(z)}, static_cast<float>(kCoarseEdge) * map_.voxel_size);
      const float to_centre = length(centre - at);
      if (layer > least || (layer == least && to_centre >= way)) return;
      least = layer;
      way = to_centre;
      next = centre;
    });
    const bool found_one = length(next - at) > 0;
    at = next;
    return found_one;
  }

  // For points to which the band is closer than the next block's centre.
  bool to_smaller_sample(Vec3& at, float residual) const noexcept {
    constexpr float kProbes[] = {1, 2, 4, 8, 16};  // [vx]
    for (const float probe : kProbes) {
      float smallest = 0.99F * residual;
      Vec3 next = at;
      for_each_neighbour([&](std::int64_t x, std::int64_t y, std::int64_t z) {
        const Vec3 there = at + scaled({float(x), float(y), float(z)}, probe * map_.voxel_size);
        const FieldCell cell = find_cell(map_, there);
        if (!octree::is_brick(cell.entry)) return;
        const float v = std::abs(interpolate(map_, cell));
        if (v >= smallest) return;
        smallest = v;
        next = there;
      });
      if (length(next - at) > 0) {
        at = next;
        return true;
      }
    }
    return false;
  }

  template <class Visit>
  static void for_each_neighbour(Visit visit) noexcept {
    for (std::int64_t z = -1; z <= 1; ++z) {
      for (std::int64_t y = -1; y <= 1; ++y) {
        for (std::int64_t x = -1; x <= 1; ++x) {
          if (x != 0 || y != 0 || z != 0) visit(x, y, z);
        }
      }
    }
  }

  const VoxelmapView& map_;
  const float tolerance_;
  std::uint32_t left_;
};

// Moves along the surface towards the query point, as the closest point's normal leads to it. A step goes to the foot
// of the query point on the tangent plane, then back to the surface. Steps repeat while they shorten the distance.
void slide(const VoxelmapView& map, Vec3 point, SurfaceWalk& walk, ClosestPoint& result) noexcept {
  const float least_gain = 1e-3F * map.voxel_size;
  const Vec3 extent{map.bounds_max[0] - map.bounds_min[0], map.bounds_max[1] - map.bounds_min[1],
                    map.bounds_max[2] - map.bounds_min[2]};
  const float longest = 0.5F * length(extent);
  float part = 1;
  constexpr float kLeastPart = 1.0F / 128;
  while (part > kLeastPart) {
    const Vec3 n = normal_at(map, result.position);
    if (dot(n, n) == 0) return;
    const Vec3 to_point = point - result.position;
    const Vec3 along = to_point - scaled(n, dot(to_point, n));
    const float way = std::min(length(along), longest);
    if (!(way > least_gain)) return;
    Vec3 next = result.position + scaled(along, part * way / length(along));
    float residual = 0;
    const bool arrived = walk.to_surface(next, residual);
    const float distance = length(point - next);
    if (!arrived || !(distance < result.distance - least_gain)) {
      part /= 2;
      continue;
    }
    result.position = next;
    result.distance = distance;
    result.residual = residual;
    part = std::min(2 * part, 1.0F);
  }
}

}  // namespace

Status detail::closest_point_from(const VoxelmapView& map, Vec3 point, Vec3 start, const ClosestPointOptions& options,
                                  ClosestPoint& result) noexcept {
  result = {};
  if (map.field == Field::none || map.field == Field::layers) return Status::missing_part;
  constexpr float kFarthest = 1e15F;  // its square fits a float
  if (!is_within(point, kFarthest) || !is_within(start, kFarthest)) return Status::bad_argument;
  if (!(options.tolerance_vx > 0 && std::isfinite(options.tolerance_vx)) || options.max_iterations == 0) {
    return Status::bad_argument;
  }
  const Interval at_point = penetration_interval(map, point);
  // Float coordinates and their differences are rounded.
  const float rounding = 1e-6F * (std::abs(point.x) + std::abs(point.y) + std::abs(point.z));
  result.inside = voxelmap_penetration(map, point, {}) >= 0;
  result.lower = std::max(std::max(at_point.low, -at_point.high) - rounding, 0.0F);
  result.upper = std::max(std::abs(at_point.low), std::abs(at_point.high)) + rounding;

  SurfaceWalk walk(map, options);
  result.position = start;
  result.converged = walk.to_surface(result.position, result.residual);
  result.distance = length(point - result.position);
  if (!result.converged) return Status::ok;
  slide(map, point, walk, result);
  result.outward_normal = normal_at(map, result.position);
  const Interval there = penetration_interval(map, result.position);
  result.upper =
      std::min(result.upper, result.distance + std::max(std::abs(there.low), std::abs(there.high)) + rounding);
  return Status::ok;
}

Status closest_point(const VoxelmapView& map, Vec3 point, const ClosestPointOptions& options,
                     ClosestPoint& result) noexcept {
  return detail::closest_point_from(map, point, point, options, result);
}

}  // namespace vps

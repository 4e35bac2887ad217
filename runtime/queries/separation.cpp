// SPDX-License-Identifier: Zlib
// Separation and penetration of a shell's deepest point, with bounds for the true surfaces: docs/internals/bounds.md.
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/fields/analytic_fields.h"
#include "runtime/grow.h"
#include "runtime/queries/closest_pair.h"
#include "runtime/queries/closest_point.h"
#include "runtime/queries/find_deepest.h"

namespace vps {
namespace {

using namespace detail;

Status check_separation(const PointshellView& shell, const Pose& pose, const SeparationOptions& options,
                        SeparationResult& result) noexcept {
  result = {};
  if (shell.points == 0) return Status::missing_part;
  if (!(options.tolerance >= 0) || options.guess >= shell.points) return Status::bad_argument;
  return check_pose(pose);
}

// Values of a field at the deepest point.
struct DeepestPoint {
  bool walked = false;  // the point is outside, and a walk led from it to `surface`
  Vec3 surface;
  float v = 0;       // [m]
  Interval truth{};  // of V. [m]
  Vec3 direction;
};

// @param start  where a walk to the surface begins. [m]
DeepestPoint deepest_at(const VoxelmapView& map, Vec3 point, Vec3 inward_normal, Vec3 start) noexcept {
  DeepestPoint out;
  out.v = voxelmap_penetration(map, point, inward_normal);
  out.truth = penetration_interval(map, point);
  out.direction = normal_at(map, point);
  // Beyond the band, a walk to the surface gives a more accurate distance than the layers.
  const CertifiedBand certified = certified_band(map);
  if (map.field == Field::layers || (out.v > -certified.outer && out.v < certified.inner)) return out;
  ClosestPoint closest;
  if (closest_point_from(map, point, start, {}, closest) != Status::ok || !closest.converged) return out;
  if (!(closest.distance > 0)) return out;
  const Vec3 away = closest.inside ? closest.position - point : point - closest.position;
  if (closest.inside) {
    out.v = std::clamp(closest.distance, out.truth.low, out.truth.high);
    out.direction = (1 / closest.distance) * away;
    return out;
  }
  out.walked = true;
  out.surface = closest.position;
  out.v = std::min(-closest.distance, out.truth.high);
  out.truth.low = std::max(out.truth.low, -closest.upper);
  out.direction = (1 / closest.distance) * away;
  return out;
}
template <class Analytic>
DeepestPoint deepest_at(const Analytic& field, Vec3 p, Vec3, Vec3) noexcept {
  DeepestPoint out;
  out.v = value_at(field, p);
  out.truth = {out.v, out.v};
  out.direction = normal_at(field, p);
  return out;
}
DeepestPoint deepest_at(const PolytopeField& field, Vec3 p, Vec3 inward_normal, Vec3 start) noexcept {
  DeepestPoint out = deepest_at<PolytopeField>(field, p, inward_normal, start);
  // V is exact if the nearest point of the farthest plane lies on the body.
  const Vec3 on_plane{p.x + out.v * out.direction.x, p.y + out.v * out.direction.y, p.z + out.v * out.direction.z};
  if (out.v < 0 && value_at(field, on_plane) < 1e-5F * out.v) {
    out.truth.low = -std::numeric_limits<float>::infinity();
  }
  return out;
}

// Error bound of a field's V. [m]
float value_error(const VoxelmapView& map) noexcept {
  return map.field == Field::layers ? 0 : field_error(map);
}
template <class Field>
float value_error(const Field&) noexcept {
  return 0;
}

// Arguments of one query.
template <class Field>
struct SeparationQuery {
  const PointshellView& shell;
  const Field& field;
  const Pose& pose;
  const SeparationOptions& options;
  Scratch& scratch;
};

// @param pose   takes the shell to the field in kernel form
// @param guess  the point to start from
template <class Field>
DeepestSearch new_search(const SeparationQuery<Field>& query, const Frame& frame, const Pose& pose,
                         std::uint32_t guess) noexcept {
  const PointshellView& shell = query.shell;
  DeepestSearch search;
  search.shell = &shell;
  search.unit = static_cast<float>(frame.unit);
  search.radius_scale = shell.position_step / search.unit;
  search.points = affine(pose, frame, shell.position_origin, shell.position_step);
  search.slack = rounding(shell, pose, frame);
  search.stack = query.scratch.queue;
  search.bounds = query.scratch.bounds;
  search.point = guess;
  return search;
}

template <class KernelField>
void search_without_floor(const KernelField& field, DeepestSearch& search) noexcept {
  const std::uint32_t nodes = search.nodes_tested;
  const std::uint32_t points = search.points_tested;
  search.floor = std::numeric_limits<float>::lowest();
  find_deepest(field, search);
  search.nodes_tested += nodes;
  search.points_tested += points;
}

// @param start  where a walk to the field's surface begins; null: at the point
template <class Field>
DeepestPoint deepest_of(const SeparationQuery<Field>& query, std::uint32_t point, const Vec3* start,
                        Vec3& position) noexcept {
  const Transform transform(query.pose);
  position = transform.apply(point_position(query.shell, point));
  return deepest_at(query.field, position, transform.rotate(point_inward_normal(query.shell, point)),
                    start != nullptr ? *start : position);
}

// Moves the origin of the field's frame.
Pose seen_from(Vec3 origin, Pose pose) noexcept {
  const float at[3] = {origin.x, origin.y, origin.z};
  for (int axis = 0; axis < 3; ++axis) pose.translation[axis] -= at[axis];
  return pose;
}

// Beyond the band, the deepest point by the layers may not be the closest. Searches the shell's point that is closest
// to the end of the walk, and walks from it to the surface. Repeats this while the distance shrinks.
DeepestPoint come_closer(const SeparationQuery<VoxelmapView>& query, DeepestPoint deepest,
                         SeparationResult& result) noexcept {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds && deepest.walked; ++round) {
    DeepestSearch search = new_search(query, {}, seen_from(deepest.surface, query.pose), result.point);
    find_deepest(SphereField(), search);
    result.nodes_tested += search.nodes_tested;
    result.points_tested += search.points_tested;
    if (search.point == result.point) break;
    Vec3 position;
    const DeepestPoint next = deepest_of(query, search.point, &deepest.surface, position);
    if (!(next.v > deepest.v)) break;
    deepest = next;
    result.point = search.point;
    result.position = position;
  }
  return deepest;
}
template <class Field>
DeepestPoint come_closer(const SeparationQuery<Field>&, const DeepestPoint& deepest, SeparationResult&) noexcept {
  return deepest;
}

// Whether the field tells which side a point is on, and so the deepest point in its band.
bool has_band(const VoxelmapView& map) noexcept {
  return certified_band(map).outer > value_error(map);
}
bool has_field_shell(const SeparationOptions& options) noexcept {
  return options.field_shell != nullptr && options.field_shell->points > 0;
}

// Lower bound of the distance of all points from the bounds of the field's mesh. [m]
float distance_from_bounds(const SeparationQuery<VoxelmapView>& query, std::uint32_t guess) noexcept {
  const float* const low = query.field.bounds_min;
  const float* const high = query.field.bounds_max;
  const BoxField box{{(high[0] - low[0]) / 2, (high[1] - low[1]) / 2, (high[2] - low[2]) / 2}};
  const Vec3 centre{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
  DeepestSearch search = new_search(query, {}, seen_from(centre, query.pose), guess);
  search.margin = -query.options.tolerance;
  find_deepest(box, search);
  return -std::max(search.best, search.rejected) - search.slack;
}

// The deepest point of a shell that is apart from the field's body, and how near the field's surface is to any point.
struct Apart {
  DeepestPoint deepest;
  float nearest = 0;  // lower bound of the distance of all points. [m]
};
Apart find_apart(const SeparationQuery<VoxelmapView>& query, SeparationResult& result) noexcept {
  const PointshellView& other = *query.options.field_shell;
  constexpr float kRelative = 0.02F;
  const ClosestPair pair =
      find_closest_pair(query.shell, other, query.pose, {query.options.tolerance, kRelative, query.options.guess});
  result.nodes_tested += pair.nodes_tested;
  result.points_tested += pair.points_tested;
  result.point = pair.first;
  const Vec3 start = point_position(other, pair.second);
  Apart apart;
  apart.deepest = deepest_of(query, pair.first, &start, result.position);
  apart.nearest = std::max(pair.bound - other.covering_radius, distance_from_bounds(query, pair.first));
  return apart;
}

// @param kernel_field  the field in kernel form
// @param kernel_pose   takes the shell to it
// @param error         the field's error, which the kernel's upper bounds do not include. [m]
template <class Field, class KernelField>
Status find(const SeparationQuery<Field>& query, const KernelField& kernel_field, const Frame& frame,
            const Pose& kernel_pose, float error, SeparationResult& result) noexcept {
  const PointshellView& shell = query.shell;
  if (const Status status = try_to_grow([&] { query.scratch.reserve(shell); }); status != Status::ok) return status;
  const auto unit = static_cast<float>(frame.unit);
  DeepestSearch search = new_search(query, frame, kernel_pose, query.options.guess);
  // V may be too large at a point, and too small at the centre of its sphere.
  search.margin = (2 * value_error(query.field) - query.options.tolerance) / unit;
  constexpr bool kIsMap = std::is_same_v<Field, VoxelmapView>;
  // Most of a shell lies far beyond the band of a map. A search that passes all of that is over sooner, if it finds a
  // point. Beyond the band the shells of both are compared; without the other one, the first search looks farther.
  if constexpr (kIsMap) {
    const float farther = has_field_shell(query.options) ? 1 : 2;
    if (has_band(query.field)) search.floor = -farther * certified_band(query.field).outer / unit;
  }
  find_deepest(kernel_field, search);
  const bool is_beyond = !(search.deepest > search.floor);
  const bool compares_shells = kIsMap && is_beyond && has_field_shell(query.options);
  if (is_beyond && !compares_shells) search_without_floor(kernel_field, search);

  result.point = search.point;
  result.nodes_tested = search.nodes_tested;
  result.points_tested = search.points_tested;
  const double slack = double{search.slack} * unit;
  result.delta_bound = double{unit} * std::max(search.best, search.rejected) + slack;
  double above = double{error};  // of the true V of a point above delta_bound
  DeepestPoint deepest;
  if (!compares_shells) deepest = deepest_of(query, search.point, nullptr, result.position);
  if constexpr (kIsMap) {
    if (compares_shells) {
      const Apart apart = find_apart(query, result);
      deepest = apart.deepest;
      if (-double{apart.nearest} < result.delta_bound) {
        result.delta_bound = -double{apart.nearest};
        above = 0;
      }
    }
  }
  deepest = come_closer(query, deepest, result);
  // Points lie on the surface, apart from the rounding of their codes. Every point of the surface is within the
  // covering radius of one of them.
  const double off_surface = std::sqrt(0.75) * shell.position_step + slack;
  result.delta = std::min<double>(deepest.v, result.delta_bound);
  result.upper = result.delta_bound + above + shell.covering_radius;
  result.lower = std::min(deepest.truth.low - off_surface, result.upper);
  result.direction = deepest.direction;
  return std::isfinite(result.delta) ? Status::ok : Status::bad_argument;
}

}  // namespace

Status separation(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                  const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept {
  if (const Status status = check_separation(shell, shell_to_field, options, result); status != Status::ok) {
    return status;
  }
  return field.visit([&]<class Kind>(const Kind& kind) {
    if constexpr (std::is_same_v<Kind, VoxelmapView>) {
      if (kind.field == Field::none) return Status::missing_part;
    }
    const SeparationQuery<Kind> query{shell, kind, shell_to_field, options, scratch};
    const auto run = [&](const auto& kernel_field, const Frame& frame, float error, const Pose& pose) {
      return find(query, kernel_field, frame, pose, error, result);
    };
    return in_kernel_form(kind, shell_to_field, run);
  });
}

}  // namespace vps

// SPDX-License-Identifier: Zlib
// The C interface to vps_queries.h: checks arguments, converts, forwards.
#include "runtime/vps_queries.h"

#include "runtime/c/vps_c.h"

namespace {

using namespace vps::c;
using vps::c::to_c;

static_assert(vps_contactor_points == static_cast<int>(vps::Contactor::points));
static_assert(vps_impact_none == static_cast<int>(vps::Impact::none));
static_assert(vps_impact_unfinished == static_cast<int>(vps::Impact::unfinished));

VpsSeparation to_c(const vps::SeparationResult& from) {
  VpsSeparation to{};
  to.delta = from.delta;
  to.delta_bound = from.delta_bound;
  to.lower = from.lower;
  to.upper = from.upper;
  copy(from.position, to.position);
  copy(from.direction, to.direction);
  to.point = from.point;
  to.nodes_tested = from.nodes_tested;
  to.points_tested = from.points_tested;
  return to;
}

vps::Sweep to_sweep(const VpsSweep& from) {
  vps::Sweep sweep;
  sweep.start = to_pose(from.start);
  std::copy_n(from.velocity, 3, sweep.velocity);
  std::copy_n(from.angular_velocity, 3, sweep.angular_velocity);
  sweep.duration = from.duration;
  return sweep;
}

VpsStatus separate(const VpsPointshell* shell, vps::FieldRef field, const vps::PointshellView* field_shell,
                   const VpsPose* pose, const VpsSeparationOptions* options, VpsScratch* scratch,
                   VpsSeparation* result) {
  if (shell == nullptr || pose == nullptr || result == nullptr) return vps_bad_argument;
  vps::SeparationOptions given;
  if (options != nullptr) given = {options->tolerance, options->guess};
  given.field_shell = field_shell;
  if (!is_in_range(given.tolerance)) return vps_bad_argument;
  if (const VpsStatus status = reserve(scratch, shell, 0); status != vps_ok) return status;
  vps::SeparationResult found;
  const vps::Status status = vps::separation(shell->view, field, to_pose(*pose), given, scratch->scratch, found);
  if (status == vps::Status::ok) *result = to_c(found);
  return to_c(status);
}

VpsStatus time_impact(const VpsPointshell* shell, vps::FieldRef field, const vps::PointshellView* field_shell,
                      const VpsSweep* sweep, const VpsImpactOptions* options, VpsScratch* scratch,
                      VpsImpactResult* result) {
  if (shell == nullptr || sweep == nullptr || result == nullptr) return vps_bad_argument;
  vps::ImpactOptions given;
  if (options != nullptr) {
    if (options->contactor != vps_contactor_surface && options->contactor != vps_contactor_points) {
      return vps_bad_argument;
    }
    if (!is_in_range(options->distance) || !is_in_range(options->tolerance)) return vps_bad_argument;
    given.distance = options->distance;
    given.tolerance = options->tolerance;
    given.contactor = static_cast<vps::Contactor>(options->contactor);
    given.max_iterations = options->max_iterations;
  }
  given.field_shell = field_shell;
  if (const VpsStatus status = reserve(scratch, shell, 0); status != vps_ok) return status;
  vps::ImpactResult found;
  const vps::Status status = vps::time_of_impact(shell->view, field, to_sweep(*sweep), given, scratch->scratch, found);
  if (status == vps::Status::ok) {
    *result = {static_cast<VpsImpact>(found.impact), found.time, to_c(found.separation), found.iterations};
  }
  return to_c(status);
}

}  // namespace

VpsStatus vps_separation(const VpsPointshell* shell, VpsFieldRef field, const VpsPose* shell_to_field,
                         const VpsSeparationOptions* options, VpsScratch* scratch, VpsSeparation* result) {
  return with_field(field, [&](vps::FieldRef ref) {
    return separate(shell, ref, shell_of(field), shell_to_field, options, scratch, result);
  });
}

VpsStatus vps_sweep_pose(const VpsPointshell* shell, const VpsSweep* sweep, double time, VpsPose* pose) {
  if (shell == nullptr || sweep == nullptr || pose == nullptr || !std::isfinite(time)) return vps_bad_argument;
  const vps::Pose at = vps::pose_at(shell->view, to_sweep(*sweep), time);
  if (vps::check_pose(at) != vps::Status::ok) return vps_bad_argument;
  std::copy_n(at.rotation, 9, pose->rotation);
  std::copy_n(at.translation, 3, pose->translation);
  return vps_ok;
}

VpsStatus vps_time_of_impact(const VpsPointshell* shell, VpsFieldRef field, const VpsSweep* sweep,
                             const VpsImpactOptions* options, VpsScratch* scratch, VpsImpactResult* result) {
  return with_field(field, [&](vps::FieldRef ref) {
    return time_impact(shell, ref, shell_of(field), sweep, options, scratch, result);
  });
}

VpsStatus vps_cast_ray(const VpsVoxelmap* map, const VpsRay* ray, float tolerance_vx, VpsRayHit* result) {
  if (map == nullptr || ray == nullptr || result == nullptr || !std::isfinite(tolerance_vx)) return vps_bad_argument;
  vps::RayHit found;
  const vps::Status status = vps::cast_ray(
      map->view, {to_vec3(ray->origin), to_vec3(ray->direction), ray->max_distance}, {tolerance_vx}, found);
  if (status != vps::Status::ok) return to_c(status);
  result->hit = found.hit ? 1 : 0;
  result->distance = found.distance;
  copy(found.position, result->position);
  copy(found.outward_normal, result->outward_normal);
  result->steps = found.steps;
  return vps_ok;
}

VpsStatus vps_closest_point(const VpsVoxelmap* map, const float point[3], const VpsClosestPointOptions* options,
                            VpsClosestPoint* result) {
  if (map == nullptr || !is_in_range(point) || result == nullptr) return vps_bad_argument;
  vps::ClosestPointOptions given;
  if (options != nullptr) given = {options->tolerance_vx, options->max_iterations};
  vps::ClosestPoint found;
  const vps::Status status = vps::closest_point(map->view, to_vec3(point), given, found);
  if (status != vps::Status::ok) return to_c(status);
  result->converged = found.converged ? 1 : 0;
  result->inside = found.inside ? 1 : 0;
  copy(found.position, result->position);
  copy(found.outward_normal, result->outward_normal);
  result->distance = found.distance;
  result->residual = found.residual;
  result->lower = found.lower;
  result->upper = found.upper;
  return vps_ok;
}

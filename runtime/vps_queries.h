// SPDX-License-Identifier: Zlib
/// @file Distances of baked assets: separation with a two-sided bound, time of impact, rays, closest points.
///
/// Frames, signs and units are those of vps_runtime.h. As there, queries are const on shared assets, allocate nothing
/// once their Scratch has grown, and never throw. docs/bounds.md proves what the bounds here promise.
#pragma once

#include <cstdint>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps {

struct SeparationOptions {
  float tolerance = 0;  ///< the search may end while a point deeper by no more is left. [Limits: value >= 0] [Units: m]
  std::uint32_t guess = 0;  ///< a point to start from, as the last SeparationResult::point. [Limits: value < points]
};

/// Penetration of a shell's body by its deepest point; minus the separation when the bodies are apart. A body that
/// swallows the other whole has no surface in it, and is apart from it.
struct SeparationResult {
  double delta = 0;         ///< V of the deepest point. Beyond the map's band by the length of a walk
                            ///< from the point to the map's surface, where there is one. [m]
  double delta_bound = 0;   ///< no point of the shell has a larger V, by the field: at least `delta`. [m]
  double lower = 0;         ///< the largest true V of the true surface, not of its samples, is no less [m]
  double upper = 0;         ///< and no more. [m]
  Vec3 position;            ///< of the deepest point, map frame. [m]
  Vec3 direction;           ///< out of the map there, unit; zero where the field has none. [-]
  std::uint32_t point = 0;  ///< index of the deepest point
  std::uint32_t nodes_tested = 0;
  std::uint32_t points_tested = 0;
};

/// The deepest point of a shell, by branch and bound; exact with the default options for a field's points in the band
/// that its certificate covers.
/// `lower` is minus infinity where a polytope's planes do not determine its distance.
/// @param shell_to_field  takes the shell's asset frame to the field's frame: relative_pose(field's body, shell's body)
/// @return `bad_pose`; `bad_argument` for options outside their limits and fields that are not finite; `missing_part`.
[[nodiscard]] Status separation(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;

struct ClosestPointOptions {
  float tolerance_vx = 0.01F;          ///< |V| at the point that is found. [Limits: value > 0] [Units: vx]
  std::uint32_t max_iterations = 256;  ///< steps. [Limits: value >= 1]
};

/// `lower` and `upper` hold whether the walk converged or not; nothing else does then.
struct ClosestPoint {
  bool converged = false;
  bool inside = false;  ///< V >= 0 at the point that was asked for
  Vec3 position;        ///< on the surface, map frame. [m]
  Vec3 outward_normal;  ///< there, unit; zero where the field has none. [-]
  float distance = 0;   ///< from the point to `position`. [m]
  float residual = 0;   ///< |V| at `position`. [m]
  float lower = 0;      ///< the true distance to the surface is no less [m]
  float upper = 0;      ///< and no more. [m]
};

/// The surface point of a map that is closest to a point, by Newton steps on the interpolated V and then along the
/// surface: a local minimum of the distance, the least one where `distance` is at `lower`.
/// @param point  map frame. [m]
/// @return `missing_part` without a field and for Field::layers, which has no distances to walk by; `bad_argument` for
///         options outside their limits and a point that is not finite or farther than 1e15 m.
[[nodiscard]] Status closest_point(const VoxelmapView& map, Vec3 point, const ClosestPointOptions& options,
                                   ClosestPoint& result) noexcept;

struct Ray {
  Vec3 origin;                                                  ///< map frame. [m]
  Vec3 direction{0, 0, 1};                                      ///< [Limits: unit length to 1e-3]
  float max_distance = std::numeric_limits<float>::infinity();  ///< along the ray. [Limits: value >= 0] [Units: m]
};

struct RayOptions {
  float tolerance_vx = 1e-3F;  ///< how closely a crossing is found, down to 1e-6. [Limits: value > 0] [Units: vx]
};

struct RayHit {
  bool hit = false;
  float distance = 0;   ///< from the ray's origin. [m]
  Vec3 position;        ///< map frame. [m]
  Vec3 outward_normal;  ///< there, unit; zero where the field has none. [-]
  std::uint32_t steps = 0;
};

/// The first place along a ray where V >= 0: 0 for a ray that starts inside. The interpolated V is searched cell by
/// cell for its first root, so that no wall that the field has is passed over, however thin; a ray that only grazes it,
/// within the tolerance, may hit.
/// @return `missing_part` without a field and for Field::layers, which has no distances; `bad_argument` for a ray or
///         options outside their limits.
[[nodiscard]] Status cast_ray(const VoxelmapView& map, const Ray& ray, const RayOptions& options,
                              RayHit& result) noexcept;

/// A shell that moves with constant velocities, in the field's frame: its centre of mass on a line, the body about it.
struct Sweep {
  Pose start;                              ///< shell_to_map at time 0
  double velocity[3] = {0, 0, 0};          ///< of the centre of mass. [m/s]
  double angular_velocity[3] = {0, 0, 0};  ///< [rad/s]
  double duration = 1;                     ///< [Limits: value >= 0] [Units: s]
};

/// shell_to_map at a time. [s]
[[nodiscard]] Pose pose_at(const PointshellView& shell, const Sweep& sweep, double time) noexcept;

/// What must not reach the field before ImpactResult::time.
enum class Contactor : std::uint8_t {
  surface,  ///< the body's true surface: impacts are reported up to a covering radius early
  points,   ///< the shell's points, the only ones that traverse tests
};

struct ImpactOptions {
  float distance = 0;  ///< at which an impact counts as such. [Limits: value >= 0] [Units: m]
  float tolerance =
      1e-4F;  ///< an impact is reported when no more than this is left to `distance`. [Limits: value > 0] [Units: m]
  Contactor contactor = Contactor::surface;
  std::uint32_t max_iterations = 256;  ///< of advancement: each is one separation query. [Limits: value >= 1]
};

enum class Impact : std::uint8_t {
  none,        ///< not before the sweep's end
  hit,         ///< the bodies may be at the distance asked for
  unfinished,  ///< max_iterations were not enough: no impact before `time`
};

struct ImpactResult {
  Impact impact = Impact::none;
  double time = 0;              ///< no impact before. [Limits: 0 <= value <= duration] [Units: s]
  SeparationResult separation;  ///< the last one asked for; at `time` with Impact::hit
  std::uint32_t iterations = 0;
};

/// When a moving shell first comes as near to a field as asked for, by conservative advancement (Mirtich 1996): time
/// goes on by what the separation's bound allows at the largest speed of any point. Never later than the true time, by
/// the field's certificate; earlier by what tolerance, field error and, with Contactor::surface, the covering radius
/// take.
/// @return as separation; `bad_argument` also for a sweep that is not finite.
[[nodiscard]] Status time_of_impact(const PointshellView& shell, FieldRef field, const Sweep& sweep,
                                    const ImpactOptions& options, Scratch& scratch, ImpactResult& result) noexcept;

}  // namespace vps

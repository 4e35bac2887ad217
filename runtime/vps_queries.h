// SPDX-License-Identifier: Zlib
/// @file Distances of baked assets: separation with a two-sided bound, time of impact, rays, closest points.
///
/// Frames, signs and units are those of vps_runtime.h. As there, queries are const on shared assets, allocate nothing
/// once their Scratch has grown, and never throw. docs/internals/bounds.md proves the bounds.
#pragma once

#include <cstdint>
#include <limits>

#include "runtime/vps_runtime.h"

namespace vps {

struct SeparationOptions {
  float tolerance = 0;  ///< the search may miss a point that is deeper by at most this. [Limits: value >= 0] [Units: m]
  std::uint32_t guess = 0;  ///< point to start from, such as the last SeparationResult::point. [Limits: value < points]
  /// The points of the voxelmap's body, in its frame and at its scale. Beyond the band a voxelmap says little: with
  /// them bodies that are apart are compared shell with shell, and the deepest point is found to a fiftieth of the
  /// distance. Null: it may be another one than the closest, as `upper` says. Not used
  /// with layers and other fields.
  const PointshellView* field_shell = nullptr;
};

/// Penetration of a shell's deepest point; negative: minus the separation. If the shell's body encloses the field's
/// body, the bodies count as separate, because no surface of the shell lies inside the field.
struct SeparationResult {
  double delta = 0;         ///< V of the deepest point. Beyond the map's band its size is the length of a walk
                            ///< from the point to the map's surface, if the walk arrives. [m]
  double delta_bound = 0;   ///< upper bound of V over all points of the shell; at least `delta`. [m]
  double lower = 0;         ///< lower bound of the largest true V of the true surface, not of its samples. [m]
  double upper = 0;         ///< upper bound of the same. [m]
  Vec3 position;            ///< of the deepest point, map frame. [m]
  Vec3 direction;           ///< out of the map there, unit; zero where the field has none. [-]
  std::uint32_t point = 0;  ///< index of the deepest point
  std::uint32_t nodes_tested = 0;
  std::uint32_t points_tested = 0;
};

/// Finds the deepest point of a shell by branch and bound. With the default options it is exact if the point lies in
/// the band that the field's certificate covers; for bodies farther apart see SeparationOptions::field_shell. Deeper
/// inside, `point` has the largest V of Field::scaled. `lower` is minus infinity where a polytope's planes do not
/// determine its distance.
/// @param shell_to_field  takes the shell's asset frame to the field's frame: relative_pose(field's body, shell's body)
/// @return `bad_pose`; `bad_argument` for options outside their limits and fields that are not finite; `missing_part`.
[[nodiscard]] Status separation(const PointshellView& shell, FieldRef field, const Pose& shell_to_field,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;

struct ClosestPointOptions {
  float tolerance_vx = 0.01F;          ///< the walk ends where |V| is at most this. [Limits: value > 0] [Units: vx]
  std::uint32_t max_iterations = 256;  ///< steps. [Limits: value >= 1]
};

/// `inside`, `lower` and `upper` hold even if the walk did not converge; the other results do not.
struct ClosestPoint {
  bool converged = false;
  bool inside = false;  ///< V >= 0 at the query point
  Vec3 position;        ///< on the surface, map frame. [m]
  Vec3 outward_normal;  ///< there, unit; zero where the field has none. [-]
  float distance = 0;   ///< from the point to `position`. [m]
  float residual = 0;   ///< |V| at `position`. [m]
  float lower = 0;      ///< lower bound of the true distance to the surface. [m]
  float upper = 0;      ///< upper bound of the true distance to the surface. [m]
};

/// Finds the surface point of a map that is closest to a point: by Newton steps on the interpolated V, then by steps
/// along the surface. It is a local minimum of the distance, and the global one where `distance` equals `lower`.
/// @param point  map frame. [m]
/// @return `missing_part` without a field and for Field::layers, which stores no distances; `bad_argument` for
///         options outside their limits and a point that is not finite or farther than 1e15 m.
[[nodiscard]] Status closest_point(const VoxelmapView& map, Vec3 point, const ClosestPointOptions& options,
                                   ClosestPoint& result) noexcept;

struct Ray {
  Vec3 origin;                                                  ///< map frame. [m]
  Vec3 direction{0, 0, 1};                                      ///< [Limits: unit length to 1e-3]
  float max_distance = std::numeric_limits<float>::infinity();  ///< along the ray. [Limits: value >= 0] [Units: m]
};

struct RayOptions {
  float tolerance_vx = 1e-3F;  ///< accuracy of a crossing along the ray, down to 1e-6. [Limits: value > 0] [Units: vx]
};

struct RayHit {
  bool hit = false;
  float distance = 0;       ///< from the ray's origin. [m]
  Vec3 position;            ///< map frame. [m]
  Vec3 outward_normal;      ///< there, unit; zero where the field has none. [-]
  std::uint32_t steps = 0;  ///< [Limits: value <= 16 + 8 (sum of the dims)]
};

/// Finds the first place along a ray where V >= 0. The distance is 0 for a ray that starts inside. The first root of
/// the interpolated V is searched cell by cell, so no wall of the field is missed, however thin. A ray that only grazes
/// a wall, within the tolerance, may hit.
/// @return `missing_part` without a field and for Field::layers, which stores no distances; `bad_argument` for a ray or
///         options outside their limits.
[[nodiscard]] Status cast_ray(const VoxelmapView& map, const Ray& ray, const RayOptions& options,
                              RayHit& result) noexcept;

/// Motion of a shell with constant velocities, in the field's frame: its centre of mass moves along a line, and the
/// body turns about it.
struct Sweep {
  Pose start;                              ///< shell_to_field at time 0
  double velocity[3] = {0, 0, 0};          ///< of the centre of mass. [m/s]
  double angular_velocity[3] = {0, 0, 0};  ///< [rad/s]
  double duration = 1;                     ///< [Limits: value >= 0] [Units: s]
};

/// shell_to_field at a time. [s]
[[nodiscard]] Pose pose_at(const PointshellView& shell, const Sweep& sweep, double time) noexcept;

/// The part of the shell's body that does not reach the field before ImpactResult::time.
enum class Contactor : std::uint8_t {
  surface,  ///< the body's true surface: impacts are reported up to a covering radius early
  points,   ///< the shell's points, the only ones that traverse tests
};

struct ImpactOptions {
  float distance = 0;  ///< distance between the bodies that counts as an impact. [Limits: value >= 0] [Units: m]
  float tolerance =
      1e-4F;  ///< an impact is reported when the gap to `distance` is at most this. [Limits: value > 0] [Units: m]
  Contactor contactor = Contactor::surface;
  std::uint32_t max_iterations = 256;  ///< steps of advancement; each is one separation query. [Limits: value >= 1]
  const PointshellView* field_shell = nullptr;  ///< see SeparationOptions::field_shell
};

enum class Impact : std::uint8_t {
  none,        ///< none before the sweep's end
  hit,         ///< the bodies may be at ImpactOptions::distance
  unfinished,  ///< max_iterations were not enough; there is no impact before `time`
};

struct ImpactResult {
  Impact impact = Impact::none;
  double time = 0;              ///< there is no impact before it. [Limits: 0 <= value <= duration] [Units: s]
  SeparationResult separation;  ///< the last one computed; at `time` with Impact::hit
  std::uint32_t iterations = 0;
};

/// Finds when a moving shell first comes as near to a field as ImpactOptions::distance, by conservative advancement
/// (Mirtich 1996). Each step advances time by the separation's bound divided by the largest speed of any point. The
/// result is never later than the true time, as far as the field's certificate holds. It may be earlier because of the
/// tolerance, the field's error and, with Contactor::surface, the covering radius.
/// @return as separation; `bad_argument` also for a sweep that is not finite.
[[nodiscard]] Status time_of_impact(const PointshellView& shell, FieldRef field, const Sweep& sweep,
                                    const ImpactOptions& options, Scratch& scratch, ImpactResult& result) noexcept;

}  // namespace vps

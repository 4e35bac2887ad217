// SPDX-License-Identifier: Zlib
/// @file Distances of baked assets: separation with a two-sided bound, time of impact, rays, closest points.
///
/// Frames, signs and units are those of vps_runtime.h. As there, queries are const on shared assets, allocate nothing
/// once their Scratch has grown, and never throw. docs/bounds.md proves what the bounds here promise.
#pragma once

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

/// The deepest point of a shell, by branch and bound; exact with the default options, for a field's points in its band.
/// @param shell_to_map  takes the shell's asset frame to the field's frame: relative_pose(map body, shell body)
/// @return `bad_pose` also for poses farther away than 1e15 m, `bad_argument` for options outside their limits and
/// fields
///         that are not finite, `missing_part`.
[[nodiscard]] Status separation(const PointshellView& shell, const VoxelmapView& map, const Pose& shell_to_map,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;
[[nodiscard]] Status separation(const PointshellView& shell, const BoxField& field, const Pose& shell_to_field,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;
[[nodiscard]] Status separation(const PointshellView& shell, const SphereField& field, const Pose& shell_to_field,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;
[[nodiscard]] Status separation(const PointshellView& shell, const HalfSpaceField& field, const Pose& shell_to_field,
                                const SeparationOptions& options, Scratch& scratch, SeparationResult& result) noexcept;

struct ClosestPointOptions {
  float tolerance_vx = 0.01F;         ///< |V| at the point that is found. [Limits: value > 0] [Units: vx]
  std::uint32_t max_iterations = 64;  ///< look-ups. [Limits: value >= 1]
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
/// a
///         point that is not finite and options outside their limits.
[[nodiscard]] Status closest_point(const VoxelmapView& map, Vec3 point, const ClosestPointOptions& options,
                                   ClosestPoint& result) noexcept;

}  // namespace vps

// SPDX-License-Identifier: Zlib
// Conservative advancement of a moving shell. Mirtich 1996, "Impulse-based Dynamic Simulation of Rigid Body Systems".
#include <algorithm>
#include <cmath>

#include "runtime/vps_queries.h"

namespace vps {
namespace {

double norm(const double (&v)[3]) noexcept {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// Upper bound of the speed of the body's points. [m/s]
double largest_speed(const PointshellView& shell, const Sweep& sweep) noexcept {
  const float* const c = shell.centre_of_mass;
  const Vec3 root = sphere_centre(shell, 0);
  const double arm[3] = {double{root.x} - c[0], double{root.y} - c[1], double{root.z} - c[2]};
  // The true surface lies a little farther out than the points.
  const double reach = norm(arm) + sphere_radius(shell, 0) + shell.covering_radius;
  return norm(sweep.velocity) + norm(sweep.angular_velocity) * reach;
}

bool is_valid(const Sweep& sweep, const ImpactOptions& options) noexcept {
  return sweep.duration >= 0 && std::isfinite(sweep.duration) && std::isfinite(norm(sweep.velocity)) &&
         std::isfinite(norm(sweep.angular_velocity)) && options.distance >= 0 && std::isfinite(options.distance) &&
         options.tolerance > 0 && std::isfinite(options.tolerance) && options.max_iterations > 0;
}

}  // namespace

Pose pose_at(const PointshellView& shell, const Sweep& sweep, double time) noexcept {
  // Rodrigues' formula.
  const double rate = norm(sweep.angular_velocity);
  const double angle = rate * time;
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  double axis[3] = {0, 0, 0};
  for (int i = 0; i < 3 && rate > 0; ++i) axis[i] = sweep.angular_velocity[i] / rate;
  const double turn[9] = {
      cosine + axis[0] * axis[0] * (1 - cosine),         axis[0] * axis[1] * (1 - cosine) - axis[2] * sine,
      axis[0] * axis[2] * (1 - cosine) + axis[1] * sine, axis[1] * axis[0] * (1 - cosine) + axis[2] * sine,
      cosine + axis[1] * axis[1] * (1 - cosine),         axis[1] * axis[2] * (1 - cosine) - axis[0] * sine,
      axis[2] * axis[0] * (1 - cosine) - axis[1] * sine, axis[2] * axis[1] * (1 - cosine) + axis[0] * sine,
      cosine + axis[2] * axis[2] * (1 - cosine)};
  Pose out;
  for (int i = 0; i < 3; ++i) {
    double centre = sweep.start.translation[i] + sweep.velocity[i] * time;
    out.translation[i] = 0;
    for (int j = 0; j < 3; ++j) {
      centre += sweep.start.rotation[3 * i + j] * shell.centre_of_mass[j];
      double sum = 0;
      for (int k = 0; k < 3; ++k) sum += turn[3 * i + k] * sweep.start.rotation[3 * k + j];
      out.rotation[3 * i + j] = sum;
      out.translation[i] -= sum * shell.centre_of_mass[j];
    }
    out.translation[i] += centre;
  }
  return out;
}

Status time_of_impact(const PointshellView& shell, FieldRef field, const Sweep& sweep, const ImpactOptions& options,
                      Scratch& scratch, ImpactResult& result) noexcept {
  result = {};
  if (!is_valid(sweep, options)) return Status::bad_argument;
  if (shell.points == 0) return Status::missing_part;
  if (const Status status = check_pose(sweep.start); status != Status::ok) return status;
  const double speed = largest_speed(shell, sweep);
  SeparationOptions search;
  search.field_shell = options.field_shell;
  double gap = 0;
  while (result.iterations < options.max_iterations) {
    ++result.iterations;
    const Pose pose = pose_at(shell, sweep, result.time);
    if (const Status status = separation(shell, field, pose, search, scratch, result.separation);
        status != Status::ok) {
      return status;
    }
    search.guess = result.separation.point;
    const double covered = options.contactor == Contactor::points ? shell.covering_radius : 0;
    gap = covered - result.separation.upper - options.distance;
    if (gap <= options.tolerance) {
      if (search.tolerance == 0) {
        result.impact = Impact::hit;
        return Status::ok;
      }
      // The bound may come from spheres that a rough search skipped.
      search.tolerance = 0;
      continue;
    }
    const double step = gap / speed;
    if (!(result.time + step < sweep.duration)) {
      result.time = sweep.duration;
      return Status::ok;
    }
    result.time += step;
    constexpr double kRough = 0.1;  // of the last step's gap
    search.tolerance = static_cast<float>(kRough * gap);
  }
  result.impact = Impact::unfinished;
  return Status::ok;
}

}  // namespace vps

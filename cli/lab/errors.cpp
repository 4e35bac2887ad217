// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/errors.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace vps::lab {
namespace {

using Eigen::Vector3d;

Vector3d vector(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// Returns NaN when a vector is zero.
double degrees_between(const Vector3d& a, const Vector3d& b) {
  if (!(a.norm() > 0) || !(b.norm() > 0)) return kNotTold;
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / M_PI;
}

struct Lists {
  std::vector<double> normal, force, force_direction, torque;
};

bool misses(const PairAnswer& answer) {
  return answer.contacts == 0 || answer.depth < 0;
}

// An answer without a contact and without a depth counts as depth 0.
double depth_error(const PairAnswer& answer, double exact) {
  const double depth = std::isnan(answer.depth) && answer.contacts == 0 ? 0 : answer.depth;
  return std::abs(depth - exact);
}

void add(const GroundTruth& truth, const TruePose& pose, const PairAnswer& answer, double longest_side, Lists& lists) {
  const Vector3d direction = vector(answer.direction);
  lists.normal.push_back(direction.norm() > 0
                             ? degrees_between(direction, vector(truth.oracle->outward_normal(answer.position)))
                             : kNotTold);
  if (!truth.wrenches_exact()) return;
  const double typical = truth.force_rms[std::size_t(pose.range)];
  const Vector3d force = vector(answer.force);
  const Vector3d exact = vector(pose.wrench.force);
  lists.force.push_back(100 * (force - exact).norm() / typical);
  // A body pressed from two sides has a force near zero, whose direction means nothing.
  constexpr double kOneSided = 0.1;
  if (exact.norm() > kOneSided * pose.wrench.pressure) lists.force_direction.push_back(degrees_between(force, exact));
  lists.torque.push_back(100 * (vector(answer.torque) - vector(pose.wrench.torque)).norm() /
                         (typical * longest_side / 2));
}

ContactErrors errors_in(const GroundTruth& truth, std::span<const PairAnswer> answers, double longest_side,
                        PoseKind range) {
  Lists lists;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    if (truth.poses[i].range == range) add(truth, truth.poses[i], answers[i], longest_side, lists);
  }
  return {penetration_errors(truth, answers, range),
          count_missed(truth, answers, range),
          spread_of(lists.normal),
          spread_of(lists.force),
          spread_of(lists.force_direction),
          spread_of(lists.torque)};
}

}  // namespace

Errors contact_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, double longest_side) {
  return {errors_in(truth, answers, longest_side, PoseKind::contact),
          errors_in(truth, answers, longest_side, PoseKind::deep)};
}

Spread penetration_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    if (truth.poses[i].range == range) errors.push_back(depth_error(answers[i], truth.poses[i].pose.depth));
  }
  return spread_of(errors);
}

std::size_t count_missed(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range) {
  std::size_t missed = 0;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) missed += truth.poses[i].range == range && misses(answers[i]);
  return missed;
}

double deepest_missed(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range) {
  double deepest = 0;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    if (truth.poses[i].range == range && misses(answers[i])) deepest = std::max(deepest, truth.poses[i].pose.depth);
  }
  return deepest;
}

Spread distance_errors(const GroundTruth& truth, std::span<const PairAnswer> answers) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    if (truth.poses[i].range == PoseKind::apart)
      errors.push_back(std::abs(answers[i].depth - truth.poses[i].pose.depth));
  }
  return spread_of(errors);
}

Held bounds_held(const GroundTruth& truth, std::span<const PairAnswer> answers) {
  Held out;
  for (std::size_t i = 0; i < truth.poses.size(); ++i) {
    const double depth = truth.poses[i].pose.depth;
    ++out.asked;
    if (answers[i].lower <= depth + truth.options.tolerance && depth <= answers[i].upper) ++out.held;
  }
  return out;
}

Held budget_held(std::span<const PairAnswer> answers, std::span<const PairAnswer> all_points) {
  Held out;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    ++out.asked;
    if (all_points[i].depth <= answers[i].delta_bound) ++out.held;
  }
  return out;
}

}  // namespace vps::lab

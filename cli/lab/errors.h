// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Errors of answers against the exact truth. docs/internals/report_method.md defines each number.
#pragma once

#include <span>

#include "cli/lab/pair.h"
#include "cli/lab/statistics.h"
#include "cli/lab/truth.h"

namespace vps::lab {

/// Errors over one range of overlapping poses.
struct ContactErrors {
  /// |answered depth - exact depth|; the whole exact depth for an answer with neither contact nor depth. [m]
  Spread penetration;
  std::size_t missed = 0;  ///< poses whose answer has no contact or a negative depth
  Spread normal;  ///< angle between the answered direction at the deepest contact and the exact one there. [degrees]
  Spread force;   ///< |answered force - exact force|, over the RMS of the range's exact forces. [%]
  Spread force_direction;  ///< angle between the answered and the exact force. [degrees]
  Spread torque;           ///< |answered - exact torque|, over the RMS of the forces times half the longest side. [%]
};

/// Errors of answers to contact queries, in the two overlapping ranges.
struct Errors {
  ContactErrors contact;
  ContactErrors deep;
};

/// Errors of force and torque are not given where the truth's wrenches are not exact.
/// @param answers       one for each pose of the truth
/// @param longest_side  longest side of the body's bounds. [m]
[[nodiscard]] Errors contact_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, double longest_side);

/// Only ContactErrors::penetration. @param range  not `apart`
[[nodiscard]] Spread penetration_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range);
/// Only ContactErrors::missed.
[[nodiscard]] std::size_t count_missed(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range);
/// Exact depth of the deepest of the missed contacts; 0: none is missed. [m]
[[nodiscard]] double deepest_missed(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range);

/// |answered distance - exact distance| over the poses apart. [m]
[[nodiscard]] Spread distance_errors(const GroundTruth& truth, std::span<const PairAnswer> answers);

/// Number of poses for which a bound holds.
struct Held {
  std::size_t asked = 0;
  std::size_t held = 0;
};
/// Counts the answers whose interval [lower, upper] contains the exact depth, within the oracle's tolerance.
[[nodiscard]] Held bounds_held(const GroundTruth& truth, std::span<const PairAnswer> answers);

/// Counts the answers under a budget or at a coarser level whose `delta_bound` is at least the depth over all points.
/// @param all_points  answers to the same poses without budget and level
[[nodiscard]] Held budget_held(std::span<const PairAnswer> answers, std::span<const PairAnswer> all_points);

}  // namespace vps::lab

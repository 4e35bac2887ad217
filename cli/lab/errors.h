// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How far answers are from the truth. docs/report.md defines each number for readers.
#pragma once

#include <span>

#include "cli/lab/pair.h"
#include "cli/lab/statistics.h"
#include "cli/lab/truth.h"

namespace vps::lab {

/// Over the poses of one range that overlap.
struct ContactErrors {
  /// |told depth - exact depth|; the whole depth where there is a contact and none was told. [m]
  Spread penetration;
  std::size_t missed = 0;  ///< of them: told to be apart, or told no contact
  Spread normal;  ///< between the direction told at the deepest contact and the exact one at that place. [degrees]
  Spread force;   ///< |force told - exact|, over the RMS of the range's exact forces. [%]
  Spread force_direction;  ///< between force told and exact force. [degrees]
  Spread torque;           ///< |torque told - exact|, over that RMS times half the body's longest side. [%]
};

/// Of answers to "contacts".
struct Errors {
  ContactErrors contact;
  ContactErrors deep;
};

/// Of force and torque none is told where the truth's wrenches are not exact.
/// @param answers       one for each pose of the truth
/// @param longest_side  of the body. [m]
[[nodiscard]] Errors contact_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, double longest_side);

/// ContactErrors::penetration alone. @param range  not `apart`
[[nodiscard]] Spread penetration_errors(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range);
/// ContactErrors::missed alone.
[[nodiscard]] std::size_t count_missed(const GroundTruth& truth, std::span<const PairAnswer> answers, PoseKind range);

/// |told distance - exact distance| over the poses apart. [m]
[[nodiscard]] Spread distance_errors(const GroundTruth& truth, std::span<const PairAnswer> answers);

/// Poses for which a bound held.
struct Held {
  std::size_t asked = 0;
  std::size_t held = 0;
};
/// [lower, upper] held the exact depth, within the oracle's tolerance.
[[nodiscard]] Held bounds_held(const GroundTruth& truth, std::span<const PairAnswer> answers);

/// No point that was left out is deeper than `delta_bound`: of answers under a budget or at a coarser level, against
/// those of all points.
[[nodiscard]] Held budget_held(std::span<const PairAnswer> answers, std::span<const PairAnswer> all_points);

}  // namespace vps::lab

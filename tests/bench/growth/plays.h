// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What is timed in stock Bullet: the whole narrowphase of a step. [us]
#pragma once

#include "tests/bench/growth/bodies.h"
#include "tests/bench/growth/curves.h"

namespace vps::bench {

/// Each place as a new pair: nothing is remembered but the working memory of the thread.
[[nodiscard]] Times fresh(bullet::Shape& shape, const Ground& ground, const std::vector<btTransform>& places);

struct Ride {
  int before = 30;    ///< steps that are not timed
  double rate = 240;  ///< [Hz]
  double speed = 0;   ///< along x, without friction. [Units: vx per step]
};
/// A body lies or slides on the ground under gravity, for up to 120 steps.
/// @param end  gets the last place; may be null
Times ride(bullet::Shape& shape, const Ground& ground, const btTransform& start, const Ride& ride,
           btTransform* end = nullptr);

/// A body is moved along a path, with the velocity of each step.
[[nodiscard]] Times drive(bullet::Shape& shape, const Ground& ground, const std::vector<btTransform>& path);

enum class Play : std::uint8_t {
  first,     ///< one step of new pairs
  still,     ///< nothing moves
  placed,    ///< one body is put back and forth, without a velocity
  flying,    ///< four steps forth, four back, with the velocity of each step: contacts ahead are sought
  drifting,  ///< both bodies fly on together
  turning,   ///< one body turns about its centre, forth and back, with its velocity
};
/// Pairs 1 m apart. @return times per pair
/// @param step   along x in each step; for `turning` the way of a body's farthest points. [m]
/// @param bytes  gets the memory of a pair on the heap; may be null
Times many_pairs(btCollisionShape& shape, const std::vector<Places>& places, int pairs, Play play, double step,
                 double* bytes = nullptr);

}  // namespace vps::bench

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One query of two bodies at a pose, with the same answer for every library.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <limits>
#include <stdexcept>

#include "runtime/vps_runtime.h"

namespace vps::lab {

using Clock = std::chrono::steady_clock;

inline double microseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
}

/// @throw std::runtime_error with the status' sentence when it is not ok
inline void require_ok(Status status) {
  if (status != Status::ok) throw std::runtime_error(describe(status));
}

inline constexpr double kNotTold = std::numeric_limits<double>::quiet_NaN();

struct PairAnswer {
  double microseconds = 0;                                  ///< NaN: not timed
  double depth = kNotTold;                                  ///< negative: minus the distance. NaN: none. [m]
  double lower = -std::numeric_limits<double>::infinity();  ///< lower bound on the true depth. [m]
  double upper = std::numeric_limits<double>::infinity();   ///< upper bound on the true depth. [m]
  std::size_t contacts = 0;
  std::array<double, 3> position{};   ///< of the deepest contact, on the first body, second's frame. [m]
  std::array<double, 3> direction{};  ///< normal there, out of the second body, unit; zero: none
  /// On the first body, about its centre of mass, second's frame, over the foundation's stiffness. NaN: none.
  /// [m^3], [m^4]
  std::array<double, 3> force{kNotTold, kNotTold, kNotTold}, torque{kNotTold, kNotTold, kNotTold};
  double delta_bound = kNotTold;  ///< of QueryResult. [m]
};

/// Queries two copies of a body. The origins of the bodies' frames are their centres of mass.
class PairPeer {
 public:
  virtual ~PairPeer() = default;
  virtual PairAnswer query(const Pose& first_in_second) = 0;
};

}  // namespace vps::lab

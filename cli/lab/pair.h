// SPDX-License-Identifier: GPL-3.0-or-later
/// @file One query of two bodies at a pose, as every peer answers it.
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
  double microseconds = 0;                                  ///< NaN: there is nothing to time
  double depth = kNotTold;                                  ///< negative: minus the distance. NaN: not told. [m]
  double lower = -std::numeric_limits<double>::infinity();  ///< the true depth is told to be no less [m]
  double upper = std::numeric_limits<double>::infinity();   ///< and no more. [m]
  std::size_t contacts = 0;
  std::array<double, 3> position{};   ///< of the deepest contact, on the first body, second's frame. [m]
  std::array<double, 3> direction{};  ///< there, out of the second, unit; zero: not told
  /// On the first body, about its centre of mass, second's frame, over the foundation's stiffness. NaN: not told.
  /// [m^3], [m^4]
  std::array<double, 3> force{kNotTold, kNotTold, kNotTold}, torque{kNotTold, kNotTold, kNotTold};
  double delta_bound = kNotTold;  ///< of QueryResult. [m]
};

/// Two copies of a body. The bodies' frames lie at their centres of mass.
class PairPeer {
 public:
  virtual ~PairPeer() = default;
  virtual PairAnswer query(const Pose& first_in_second) = 0;
};

}  // namespace vps::lab

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The exact force and torque of one body in another, what Eqs. (2) and (3) come to with per-area weights as
/// points grow dense: integrals of V n and of (P - c) x V n over the first body's surface where V >= 0. Paper:
/// Sec. 2.2.
///
/// V is the oracle's. Triangles are cut in four, the one with the largest estimated error first, until what all errors
/// may sum up to is within a tolerance.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

struct WrenchOptions {
  double tolerance = 1e-3;            ///< of `pressure`, over it. [Limits: value > 0]
  double widest = 0.01;               ///< pieces that touch are cut at least so far, over the body's radius
  std::size_t most_pieces = 2000000;  ///< then the integral ends as it is: `error` says how far it got
};

struct ExactWrench {
  std::array<double, 3> force{};   ///< on the first body, second's frame, over the foundation's stiffness. [m^3]
  std::array<double, 3> torque{};  ///< about the first body's origin, second's frame. [m^4]
  double pressure = 0;             ///< integral of V: what `force` would be if all normals agreed. [m^3]
  double area = 0;                 ///< in touch. [m^2]
  double error = 0;                ///< estimate of what `pressure` is off by, over it
};

/// A closed body in a copy of it.
class WrenchOracle {
 public:
  /// @param body    its surface is integrated over
  /// @param second  V is its
  /// @pre both closed and wound outward, `second` without self-intersections
  WrenchOracle(const TriangleMesh& body, const TriangleMesh& second, WrenchOptions options = {});
  ~WrenchOracle();
  /// Any number of threads may ask.
  [[nodiscard]] ExactWrench at(const Pose& first_in_second) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vps::lab

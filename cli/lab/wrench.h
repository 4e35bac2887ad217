// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The exact force and torque of one body in another: the integrals of V n and of (P - c) x V n over the first
/// body's surface where V >= 0. Eqs. (2) and (3) with per-area weights converge to them as points grow dense. Paper:
/// Sec. 2.2.
///
/// V comes from the oracle. Triangles are cut in four, the one with the largest estimated error first, until the sum of
/// the estimated errors is within a tolerance.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

struct WrenchOptions {
  double tolerance = 1e-3;            ///< of `pressure`, relative. [Limits: value > 0]
  double widest = 0.01;               ///< pieces in contact are cut at least to this length, over the body's radius
  std::size_t most_pieces = 2000000;  ///< then the integral ends; `error` states its accuracy
};

struct ExactWrench {
  std::array<double, 3> force{};   ///< on the first body, second's frame, over the foundation's stiffness. [m^3]
  std::array<double, 3> torque{};  ///< about the first body's origin, second's frame. [m^4]
  double pressure = 0;             ///< integral of V: the length of `force` if all normals were equal. [m^3]
  double area = 0;                 ///< of the surface in contact. [m^2]
  double error = 0;                ///< estimated error of `pressure`, relative
};

/// Integrates the wrench of a closed body in another, or in a copy of itself.
class WrenchOracle {
 public:
  /// @param body    its surface is integrated over
  /// @param second  the body whose V is integrated
  /// @pre both closed and wound outward, `second` without self-intersections
  WrenchOracle(const TriangleMesh& body, const TriangleMesh& second, WrenchOptions options = {});
  ~WrenchOracle();
  /// May be called by any number of threads.
  [[nodiscard]] ExactWrench at(const Pose& first_in_second) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vps::lab

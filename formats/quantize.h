// SPDX-License-Identifier: Zlib
/// @file The codes of the pointshell's positions, normals and areas: encoded by the bake, decoded by queries.
/// docs/internals/format.md has the formulas. Standard library only; every function accepts any code.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

namespace vps {

/// Largest code of a coordinate.
inline constexpr int kLargestCode = 65535;
/// Largest code of an area.
inline constexpr int kLargestAreaCode = 255;
/// Code of 1 in an octahedral normal.
inline constexpr int kUnitCode = 2047;
/// Upper bound of the angle between a unit vector and the vector that its code gives: on the octahedron's faces the
/// codes are corners of equilateral triangles. [rad]
inline constexpr double kNormalCodeError = std::numbers::sqrt2 / kUnitCode;

/// Where the codes of positions lie: position = origin + step * code.
struct PositionScale {
  std::array<double, 3> origin{};  ///< at or just below the box's lowest corner. [m]
  double step = 0;                 ///< the same along x, y and z. [Limits: value > 0] [Units: m]
};

/// The finest scale that covers a box. Origin, step and step * code are exact in float, so that every reader decodes
/// the same floats, with fused arithmetic or without.
/// @pre low <= high, in the range of floats. [m]
inline PositionScale position_scale(const std::array<double, 3>& low, const std::array<double, 3>& high) noexcept {
  PositionScale scale;
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    auto origin = static_cast<float>(low[axis]);
    if (origin > low[axis]) origin = std::nextafter(origin, -std::numeric_limits<float>::infinity());
    scale.origin[axis] = origin;
    extent = std::max(extent, high[axis] - scale.origin[axis]);
  }
  // Eight bits of the step and sixteen of the code fill a float.
  int exponent = 0;
  const double step = std::max(extent / kLargestCode, double{std::numeric_limits<float>::min()});
  const double digits = std::ceil(256 * std::frexp(step, &exponent));
  scale.step = std::ldexp(digits, exponent - 8);
  return scale;
}

/// The nearest code. Its error is at most half a step inside the scale's box.
inline std::uint16_t encode_coordinate(double x, double origin, double step) noexcept {
  return static_cast<std::uint16_t>(std::lround(std::clamp((x - origin) / step, 0.0, double{kLargestCode})));
}
inline float decode_coordinate(std::uint16_t code, float origin, float step) noexcept {
  return origin + step * static_cast<float>(code);
}

/// A unit vector on the octahedron |x| + |y| + |z| = 1, whose lower half is folded out into the corners of the square
/// [-1, 1]^2. Meyer et al. 2010, "On Floating-Point Normal Vectors"; Cigolle et al. 2014 for the rounding.
struct OctahedralNormal {
  int u = 0, v = 0;  ///< coordinates in the square, in steps of 1 / kUnitCode
};

/// Two coordinates of 12 bits, less than 4096 each: kUnitCode + u, then kUnitCode + v, lowest bits first.
using NormalCode = std::array<std::uint8_t, 3>;

inline NormalCode pack(OctahedralNormal normal) noexcept {
  const auto u = static_cast<unsigned>(kUnitCode + normal.u);
  const auto v = static_cast<unsigned>(kUnitCode + normal.v);
  return {static_cast<std::uint8_t>(u), static_cast<std::uint8_t>(u >> 8U | v << 4U),
          static_cast<std::uint8_t>(v >> 4U)};
}
/// @param code  the three bytes of a NormalCode
inline OctahedralNormal unpack(const std::uint8_t* code) noexcept {
  return {(code[0] | (code[1] & 15) << 8) - kUnitCode, (code[1] >> 4 | code[2] << 4) - kUnitCode};
}

/// x, y, z of unit length, in the precision of Real.
template <class Real>
std::array<Real, 3> decode_normal(OctahedralNormal code) noexcept {
  // Whole numbers, exact in float, until they are scaled.
  auto x = static_cast<Real>(code.u);
  auto y = static_cast<Real>(code.v);
  const Real z = kUnitCode - std::abs(x) - std::abs(y);
  const Real fold = std::max(-z, Real{0});
  x += x >= 0 ? -fold : fold;
  y += y >= 0 ? -fold : fold;
  const Real scale = 1 / std::sqrt(x * x + y * y + z * z);
  return {x * scale, y * scale, z * scale};
}

/// The best of the four codes around the vector's place in the square.
/// @param n  unit length. [-]
inline OctahedralNormal encode_normal(const std::array<double, 3>& n) noexcept {
  const double scale = kUnitCode / (std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]));
  double u = scale * n[0];
  double v = scale * n[1];
  if (n[2] < 0) {
    const double folded = std::copysign(kUnitCode - std::abs(v), u);
    v = std::copysign(kUnitCode - std::abs(u), v);
    u = folded;
  }
  const auto in_square = [](double x) {
    return static_cast<int>(std::clamp(x, -double{kUnitCode}, double{kUnitCode}));
  };
  OctahedralNormal best;
  double least = std::numeric_limits<double>::infinity();
  for (const double du : {0.0, 1.0}) {
    for (const double dv : {0.0, 1.0}) {
      const OctahedralNormal code{in_square(std::floor(u) + du), in_square(std::floor(v) + dv)};
      const std::array<double, 3> decoded = decode_normal<double>(code);
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) squared += (decoded[axis] - n[axis]) * (decoded[axis] - n[axis]);
      if (squared < least) {
        least = squared;
        best = code;
      }
    }
  }
  return best;
}

/// The code of an area is its square root, so that small areas have small steps: with thinned faces areas differ by
/// more than 50 times. One of the two codes around the area, off by up to a step of 2 code + 1.
/// @param carry  sum of the rounding errors of the areas before, 0 at first. The next area makes up for it, so that the
///               sum of all errors is at most kLargestAreaCode * step, and that of any run twice that. [m^2]
/// @param step   the largest area / kLargestAreaCode^2. [Limits: value > 0] [Units: m^2]
inline std::uint8_t encode_area(double area, double step, double& carry) noexcept {
  const double due = std::max((area + carry) / step, 0.0);
  const double below = std::floor(std::sqrt(due));
  const double nearest = due - below * below > below + 0.5 ? below + 1 : below;
  const double root = std::sqrt(area / step);
  const double code = std::min(std::clamp(nearest, std::floor(root), std::ceil(root)), double{kLargestAreaCode});
  carry += area - step * code * code;
  return static_cast<std::uint8_t>(code);
}
template <class Real>
Real decode_area(std::uint8_t code, Real step) noexcept {
  return step * static_cast<Real>(code * code);
}

}  // namespace vps

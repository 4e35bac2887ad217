// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/quantize.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/random.h"

namespace vps::test {
namespace {

using Vector3 = std::array<double, 3>;

Vector3 random_unit(Random& random) {
  const std::array<double, 9> rotation = random.rotation();
  return {rotation[0], rotation[3], rotation[6]};
}

template <class Real>
double length(const std::array<Real, 3>& v) {
  return std::sqrt(double{v[0]} * v[0] + double{v[1]} * v[1] + double{v[2]} * v[2]);
}

// Angle between vectors of about unit length. [rad]
template <class Real>
double angle(const Vector3& a, const std::array<Real, 3>& b) {
  return 2 * std::asin(length(Vector3{a[0] - b[0], a[1] - b[1], a[2] - b[2]}) / 2);
}

TEST(Quantize, PositionsAreOffByHalfAStepAtMost) {
  Random random;
  for (const double size : {1e-5, 0.155, 0.3, 7.0, 1e4}) {
    for (const double offset : {0.0, 3.3, -2000.0}) {
      const Vector3 low = {offset * size, -offset * size, 0.1 * size};
      const Vector3 high = {low[0] + 0.2 * size, low[1] + size, low[2] + 0.7 * size};
      const PositionScale scale = position_scale(low, high);
      EXPECT_GE(scale.step * kLargestCode, size);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double origin = scale.origin[axis];
        const auto float_origin = static_cast<float>(origin);
        const auto float_step = static_cast<float>(scale.step);
        ASSERT_EQ(origin, float_origin);
        ASSERT_EQ(scale.step, float_step);
        ASSERT_LE(origin, low[axis]);
        for (int n = 0; n < 2000; ++n) {
          const double x = n == 0 ? low[axis] : n == 1 ? high[axis] : random.between(low[axis], high[axis]);
          const std::uint16_t code = encode_coordinate(x, origin, scale.step);
          const float decoded = decode_coordinate(code, float_origin, float_step);
          const double rounding = std::abs(x) * 0x1p-23;
          ASSERT_LE(std::abs(decoded - x), scale.step / 2 * (1 + 1e-9) + rounding) << x;
          // The same with and without fused multiply-add: the product is exact.
          ASSERT_EQ(decoded, std::fma(float_step, static_cast<float>(code), float_origin));
        }
      }
    }
  }
}

TEST(Quantize, TheStepIsTheLargestExtentOverTheCodes) {
  for (const double size : {1e-5, 0.155, 0.5, 1.0, 65535.0}) {
    const double step = position_scale({0, 0, 0}, {size / 3, size, 0}).step;
    EXPECT_GE(step, size / kLargestCode);
    EXPECT_LE(step, size / kLargestCode * (1 + 1.0 / 128));
  }
  EXPECT_EQ(position_scale({0, 0, 0}, {1, 65535, 1}).step, 1);
  // A box without extent has a positive step.
  EXPECT_GT(position_scale({1, 2, 3}, {1, 2, 3}).step, 0);
}

TEST(Quantize, NormalsAreOffByAFifteenthOfADegreeAtMost) {
  Random random;
  double worst = 0;
  for (int n = 0; n < 300000; ++n) {
    Vector3 normal = random_unit(random);
    // Some normals lie near the octahedron's edges and corners, where the square is folded.
    if (n % 3 == 1) normal[static_cast<std::size_t>(n / 3 % 3)] *= 1e-5;
    if (n % 3 == 2)
      normal[static_cast<std::size_t>(n / 3 % 3)] = normal[static_cast<std::size_t>((n / 3 + 1) % 3)] = 1e-5;
    const double scale = 1 / length(normal);
    for (double& x : normal) x *= scale;
    const OctahedralNormal code = unpack(pack(encode_normal(normal)).data());
    worst = std::max(worst, angle(normal, decode_normal<double>(code)));
    ASSERT_LT(angle(normal, decode_normal<float>(code)), kNormalCodeError + 2e-7);
  }
  EXPECT_LT(worst, kNormalCodeError);
  EXPECT_GT(worst, kNormalCodeError / 1.1);
}

TEST(Quantize, NoNeighbouringCodeIsNearerToTheNormal) {
  Random random;
  for (int n = 0; n < 20000; ++n) {
    const Vector3 normal = random_unit(random);
    const OctahedralNormal code = encode_normal(normal);
    const double error = angle(normal, decode_normal<double>(code));
    for (int du = -1; du <= 1; ++du) {
      for (int dv = -1; dv <= 1; ++dv) {
        const int u = std::clamp(code.u + du, -kUnitCode, kUnitCode);
        const int v = std::clamp(code.v + dv, -kUnitCode, kUnitCode);
        ASSERT_LE(error, angle(normal, decode_normal<double>({u, v})) + 1e-12);
      }
    }
  }
}

TEST(Quantize, NormalsAlongTheAxesAreExact) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Vector3 normal = {0, 0, 0};
      normal[axis] = sign;
      EXPECT_EQ(decode_normal<double>(unpack(pack(encode_normal(normal)).data())), normal);
    }
  }
}

TEST(Quantize, EveryCodeIsAUnitNormalThatIsEncodedAsItself) {
  const auto expect_unit = [](int u, int v) {
    const OctahedralNormal code{u, v};
    const OctahedralNormal packed = unpack(pack(code).data());
    ASSERT_TRUE(packed.u == u && packed.v == v) << u << ' ' << v;
    ASSERT_NEAR(length(decode_normal<float>(code)), 1, 2e-7) << u << ' ' << v;
    const Vector3 normal = decode_normal<double>(code);
    ASSERT_NEAR(length(normal), 1, 1e-15);
    // On the square's border two codes represent the same normal.
    ASSERT_LT(angle(normal, decode_normal<double>(encode_normal(normal))),
              u > kUnitCode || v > kUnitCode ? kNormalCodeError : 1e-15)
        << u << ' ' << v;
  };
  const int corners[] = {-2047, -2046, -1024, -1023, -1, 0, 1, 1023, 1024, 2046, 2047, 2048};
  for (const int u : corners) {
    for (const int v : corners) expect_unit(u, v);
  }
  for (int u = -2047; u <= 2048; u += 5) {
    for (int v = -2047; v <= 2048; v += 7) expect_unit(u, v);
  }
}

TEST(Quantize, AreasSumToTheirOwnWithinAStep) {
  Random random;
  // Areas that are equal, or spread over 9 or 27 decades; some are 0.
  for (const int power : {0, 3, 9}) {
    std::vector<double> areas;
    for (int n = 0; n < 5000; ++n)
      areas.push_back(n % 7 == 0 ? 0 : 1e-6 * std::pow(0.5 + 0.5 * random.next(), 10 * power));
    const double step = *std::max_element(areas.begin(), areas.end()) / (kLargestAreaCode * kLargestAreaCode);
    double carry = 0;
    double sum = 0;
    double stored = 0;
    for (const double area : areas) {
      sum += area;
      const float decoded = decode_area(encode_area(area, step, carry), static_cast<float>(step));
      const double code = std::sqrt(area / step);
      ASSERT_NEAR(decoded, area, 1.001 * step * (2 * std::floor(code) + 1));
      stored += double{decoded};
      ASSERT_NEAR(stored, sum, kLargestAreaCode * step + 1e-7 * sum);
    }
    EXPECT_NEAR(stored, sum, 1e-4 * sum);
  }
}

}  // namespace
}  // namespace vps::test

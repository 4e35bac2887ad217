// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/wrench.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using lab::ExactWrench;
using lab::WrenchOptions;
using lab::WrenchOracle;

// The half space z <= 0, near the origin.
TriangleMesh ground() {
  return make_box({1, 1, 1}, {0, 0, -1});
}

Pose turned_about_z(double angle, const std::array<double, 3>& translation) {
  Pose pose;
  pose.rotation[0] = pose.rotation[4] = std::cos(angle);
  pose.rotation[3] = std::sin(angle);
  pose.rotation[1] = -pose.rotation[3];
  for (std::size_t i = 0; i < 3; ++i) pose.translation[i] = translation[i];
  return pose;
}

TEST(Wrench, BoxOnAHalfSpaceIsPushedUpByDepthTimesArea) {
  // The forces on the sides of the box cancel.
  constexpr double kDepth = 0.001;
  const std::array<double, 3> half = {0.02, 0.03, 0.01};
  const std::array<double, 3> offset = {0.005, -0.002, 0};
  const ExactWrench w =
      WrenchOracle(make_box(half, offset), ground()).at(turned_about_z(0.5, {0.1, 0.05, half[2] - kDepth}));
  const double force = kDepth * 4 * half[0] * half[1];
  EXPECT_NEAR(w.force[2], force, 1e-3 * force);
  EXPECT_NEAR(w.force[0], 0, 2e-3 * force);
  EXPECT_NEAR(w.force[1], 0, 2e-3 * force);
  // Torque about the body's origin, as the middle of the bottom is off-centre: r x F.
  const double x = std::cos(0.5) * offset[0] - std::sin(0.5) * offset[1];
  const double y = std::sin(0.5) * offset[0] + std::cos(0.5) * offset[1];
  EXPECT_NEAR(w.torque[0], y * force, 0.03 * 1e-3 * force);
  EXPECT_NEAR(w.torque[1], -x * force, 0.03 * 1e-3 * force);
  EXPECT_NEAR(w.torque[2], 0, 0.03 * 1e-3 * force);
  // The bottom and the strip of the sides below the ground, where V falls from the depth to 0.
  const double around = 4 * (half[0] + half[1]);
  EXPECT_NEAR(w.area, 4 * half[0] * half[1] + around * kDepth, 0.01 * w.area);
  EXPECT_NEAR(w.pressure, force + around * kDepth * kDepth / 2, 1e-3 * w.pressure);
  EXPECT_LE(w.error, 1e-3);
}

TEST(Wrench, SphereInAHalfSpaceIsPushedUpByTheVolumeOfItsCap) {
  // In a half space V is the depth, like the pressure in water (Archimedes).
  constexpr double kRadius = 0.05;
  constexpr double kDepth = 0.003;
  const WrenchOracle oracle(make_sphere(kRadius, 5), ground());
  const ExactWrench w = oracle.at(turned_about_z(0, {0.02, 0, kRadius - kDepth}));
  const double cap = std::numbers::pi * kDepth * kDepth * (kRadius - kDepth / 3);
  EXPECT_NEAR(w.force[2], cap, 0.01 * cap);  // faces lie up to 7 um below the sphere
  for (const std::size_t i : {0, 1}) EXPECT_NEAR(w.force[i], 0, 0.01 * cap);
  for (const double t : w.torque) EXPECT_NEAR(t, 0, 0.01 * cap * kRadius);
}

TEST(Wrench, StaysWithinTheToleranceThatIsAskedFor) {
  const TriangleMesh torus = make_torus(0.05, 0.02, 60, 30);
  const Pose pose = turned_about_z(0.3, {0.138, 0.004, 0.002});
  WrenchOptions fine;
  fine.tolerance = 1e-5;
  const ExactWrench truth = WrenchOracle(torus, torus, fine).at(pose);
  ASSERT_GT(truth.pressure, 0);
  for (const double tolerance : {1e-1, 1e-2, 1e-3}) {
    WrenchOptions options;
    options.tolerance = tolerance;
    const ExactWrench w = WrenchOracle(torus, torus, options).at(pose);
    EXPECT_LE(w.error, tolerance);
    EXPECT_NEAR(w.pressure, truth.pressure, tolerance * truth.pressure);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(w.force[i], truth.force[i], tolerance * truth.pressure);
  }
}

TEST(Wrench, FindsASmallContactInTheMiddleOfALargeTriangle) {
  // A pin below a plate face of two triangles, far from their corners.
  const TriangleMesh plate = make_box({1, 1, 0.05});
  const TriangleMesh pin = make_box({0.005, 0.005, 0.2}, {0.31, 0.17, -0.2});
  constexpr double kDepth = 0.002;
  const ExactWrench w = WrenchOracle(plate, pin).at(turned_about_z(0, {0, 0, 0.05 - kDepth}));
  // V on the plate's bottom: the distance to the pin's top or to its nearest side.
  const double half = 0.005;
  const double inner = half - kDepth;
  const double pressure =
      4 * inner * inner * kDepth + 8 * inner * kDepth * kDepth / 2 + 4 * kDepth * kDepth * kDepth / 3;
  EXPECT_NEAR(w.pressure, pressure, 2e-3 * pressure);
}

TEST(Wrench, IsZeroApart) {
  const ExactWrench w = WrenchOracle(make_sphere(0.05, 3), ground()).at(turned_about_z(0, {0, 0, 0.06}));
  EXPECT_EQ(w.pressure, 0);
  EXPECT_EQ(w.area, 0);
  for (const double f : w.force) EXPECT_EQ(f, 0);
}

}  // namespace
}  // namespace vps::test

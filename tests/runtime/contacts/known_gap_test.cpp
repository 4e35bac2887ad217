// SPDX-License-Identifier: GPL-3.0-or-later
// A proven distance never claims more than the bodies have: clouds of points that move and turn at random.
#include "runtime/contacts/known_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tests/support/random.h"

namespace vps::test {
namespace {

using Triple = std::array<double, 3>;

Triple random_in(Random& random, double radius) {
  return {random.between(-radius, radius), random.between(-radius, radius), random.between(-radius, radius)};
}
double norm(const Triple& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

// A body as an engine has it: rows of four numbers, of which the last one is anything.
template <class Scalar>
struct Cloud {
  Scalar rotation[12] = {1, 0, 0, 7, 0, 1, 0, -7, 0, 0, 1, std::numeric_limits<Scalar>::quiet_NaN()};
  Scalar origin[4] = {};
  std::vector<Triple> points;

  explicit Cloud(Random& random, double size) {
    for (int i = 0; i < 12; ++i) points.push_back(random_in(random, size));
  }
  void move(const Triple& by) {
    for (std::size_t i = 0; i < 3; ++i) origin[i] = static_cast<Scalar>(double(origin[i]) + by[i]);
  }
  // By a rotation vector (Rodrigues).
  void turn(const Triple& by) {
    const double angle = norm(by);
    if (!(angle > 0)) return;
    const Triple n = {by[0] / angle, by[1] / angle, by[2] / angle};
    const double s = std::sin(angle), c = std::cos(angle);
    for (std::size_t column = 0; column < 3; ++column) {
      const Triple v = {double(rotation[column]), double(rotation[4 + column]), double(rotation[8 + column])};
      const double along = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
      const Triple across = {n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0]};
      for (std::size_t row = 0; row < 3; ++row) {
        rotation[4 * row + column] = static_cast<Scalar>(c * v[row] + s * across[row] + (1 - c) * along * n[row]);
      }
    }
  }
  [[nodiscard]] Triple world(const Triple& p) const {
    Triple out;
    for (std::size_t i = 0; i < 3; ++i) {
      out[i] = double(origin[i]);
      for (std::size_t k = 0; k < 3; ++k) out[i] += double(rotation[4 * i + k]) * p[k];
    }
    return out;
  }
  [[nodiscard]] float arm() const {
    double most = 0;
    for (const Triple& p : points) most = std::max(most, norm(p));
    return static_cast<float>(most * (1 + 1e-6));
  }
  [[nodiscard]] detail::PlaceRef<Scalar> place() const { return {rotation, origin}; }
};

template <class Scalar>
double distance(const Cloud<Scalar>& a, const Cloud<Scalar>& b) {
  double least = std::numeric_limits<double>::max();
  for (const Triple& p : a.points) {
    for (const Triple& q : b.points) {
      const Triple x = a.world(p), y = b.world(q);
      least = std::min(least, norm({x[0] - y[0], x[1] - y[1], x[2] - y[2]}));
    }
  }
  return least;
}
// From the half space z < 0 of the second body's frame.
template <class Scalar>
double distance_to_plane(const Cloud<Scalar>& a, const Cloud<Scalar>& plane) {
  double least = std::numeric_limits<double>::max();
  for (const Triple& p : a.points) {
    const Triple x = a.world(p);
    double z = 0;
    for (std::size_t i = 0; i < 3; ++i) z += double(plane.rotation[4 * i + 2]) * (x[i] - double(plane.origin[i]));
    least = std::min(least, z);
  }
  return least;
}

// @param far  of the scene from the world's origin. [m]
template <class Scalar>
void expect_no_claim_too_many(double far, bool is_plane) {
  Random random;
  int claims = 0, refusals = 0;
  for (int pair = 0; pair < 400; ++pair) {
    Cloud<Scalar> a(random, 0.1), b(random, random.between(0.02, 0.3));
    const Triple there = random_in(random, far);
    a.move({there[0], there[1], there[2] + (is_plane ? 0.4 : 0)});
    b.move(there);
    if (!is_plane) b.move({0.5, 0, 0});
    const auto apart = [&] { return is_plane ? distance_to_plane(a, b) : distance(a, b); };
    const double proven = apart();
    if (!(proven > 0)) continue;
    const float endless = std::numeric_limits<float>::infinity();
    const detail::KnownGap gap(proven, {a.place(), b.place()}, {a.arm(), is_plane ? endless : b.arm()});
    const double speed = random.between(0, 0.01), spin = random.between(0, 0.1);
    for (int step = 0; step < 60; ++step) {
      a.move(random_in(random, speed));
      b.move(random_in(random, speed));
      a.turn(random_in(random, spin));
      b.turn(random_in(random, spin / 4));
      const double now = apart();
      const double reach = random.between(0, 0.05);
      const bool is_claimed = gap.exceeds(static_cast<float>(reach), {a.place(), b.place()});
      // The numbers of the places themselves are rounded.
      if (is_claimed) {
        ASSERT_GT(now, reach - 1e-6 * (1 + (sizeof(Scalar) == 4 ? far / 10 : 0))) << pair;
      }
      (is_claimed ? claims : refusals) += 1;
    }
  }
  EXPECT_GT(claims, 1000);
  EXPECT_GT(refusals, 1000);
}

TEST(KnownGap, NoDistanceIsClaimedThatTheBodiesDoNotHave) {
  for (const bool is_plane : {false, true}) {
    expect_no_claim_too_many<float>(0, is_plane);
    expect_no_claim_too_many<float>(100, is_plane);
    expect_no_claim_too_many<double>(0, is_plane);
    expect_no_claim_too_many<double>(1e6, is_plane);
  }
}

TEST(KnownGap, ItHoldsForBodiesThatDriftTogetherAndEndsWithTheirApproach) {
  Random random;
  Cloud<float> a(random, 0.1), b(random, 0.1);
  b.move({0.5, 0, 0});
  const detail::KnownGap gap(0.3, {a.place(), b.place()}, {a.arm(), b.arm()});
  for (int step = 0; step < 100; ++step) {
    a.move({0.25, 0.5, 0});
    b.move({0.25, 0.5, 0});
    ASSERT_TRUE(gap.exceeds(0.2999F, {a.place(), b.place()}));
  }
  b.move({-0.1, 0, 0});
  EXPECT_TRUE(gap.exceeds(0.19F, {a.place(), b.place()}));
  EXPECT_FALSE(gap.exceeds(0.21F, {a.place(), b.place()}));
}

TEST(KnownGap, NothingIsKnownWithoutAProofOrWithoutAPlace) {
  Random random;
  Cloud<float> a(random, 0.1), b(random, 0.1);
  EXPECT_FALSE(detail::KnownGap().exceeds(0, {a.place(), b.place()}));
  const detail::KnownGap gap(0.3, {a.place(), b.place()}, {a.arm(), b.arm()});
  EXPECT_TRUE(gap.exceeds(0.2F, {a.place(), b.place()}));
  for (float* const number : {&a.origin[1], &b.rotation[5], &b.rotation[2]}) {
    const float before = std::exchange(*number, std::numeric_limits<float>::quiet_NaN());
    EXPECT_FALSE(gap.exceeds(0.2F, {a.place(), b.place()}));
    *number = before;
  }
}

}  // namespace
}  // namespace vps::test

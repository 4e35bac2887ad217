// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "runtime/vps_contacts.h"
#include "tests/runtime/pair.h"

namespace vps::test {
namespace {

constexpr PenaltyLaw kSpring{2e8, 0};

Vec3 plus(Vec3 a, Vec3 b, float times) {
  return {a.x + times * b.x, a.y + times * b.y, a.z + times * b.z};
}
double dot(Vec3 a, Vec3 b) {
  return double{a.x} * b.x + double{a.y} * b.y + double{a.z} * b.z;
}
Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
Vec3 random_vector(Random& random, double size) {
  const auto x = [&] { return static_cast<float>(random.between(-size, size)); };
  const float a = x();
  const float b = x();
  return {a, b, x()};
}
Vec3 random_direction(Random& random) {
  const std::array<double, 9> r = random.rotation();
  return {static_cast<float>(r[0]), static_cast<float>(r[3]), static_cast<float>(r[6])};
}
std::array<double, 6> six(const Wrench& w) {
  return {w.force[0], w.force[1], w.force[2], w.torque[0], w.torque[1], w.torque[2]};
}
Wrench wrench(std::span<const Contact> contacts, const PenaltyLaw& law, const Twist& twist) {
  Wrench out;
  EXPECT_EQ(penalty_wrench(contacts, law, twist, out), Status::ok);
  return out;
}

TEST(Penalty, IsTheSameForCoarseAndFineShells) {
  // A sphere penetrates a box by 10 mm, off-centre: there is a force and a torque about the origin.
  const double r = 0.05;
  std::vector<std::array<double, 6>> found;
  std::vector<std::uint32_t> points;
  for (const auto& [voxel_size, alpha] : {std::pair(0.0036, M_SQRT2), {0.00113, M_SQRT2}, {0.001, 0.5}}) {
    bake::BakeOptions options;
    options.voxel_size = voxel_size;
    options.alpha = alpha;
    options.voxelmap = false;
    const auto asset = baked(make_sphere(r, 5), options);
    PointshellView shell;
    ASSERT_EQ(asset->pointshell(shell), Status::ok);
    points.push_back(shell.points);
    Scratch scratch;
    std::vector<Contact> contacts(shell.points);
    QueryResult result;
    const BoxField box{{0.1F, 0.1F, 0.1F}};
    ASSERT_EQ(traverse(shell, box, pose_at(0.02, 0.03, 0.1 + r - 0.01), {}, scratch, contacts, result), Status::ok);
    found.push_back(six(wrench(std::span(contacts).first(result.contacts), kSpring, {})));
  }
  EXPECT_NEAR(points[0], 800, 100);
  EXPECT_NEAR(points[1], 8000, 800);
  EXPECT_NEAR(points[2], 80000, 8000);
  const double depth = 0.01;
  const double volume = M_PI * depth * depth * (r - depth / 3);  // Archimedes
  const std::array<double, 6> truth = {0, 0, 1, 0.03, -0.02, 0};
  for (const std::array<double, 6>& w : found) {
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(w[i], kSpring.stiffness * volume * truth[i],
                  0.05 * kSpring.stiffness * volume * (i < 3 ? 1 : std::hypot(0.03, 0.02)));
    }
  }
}

// The model that the gradient differentiates: contacts move with a rigid motion, and V falls along the field's normals.
struct Motion {
  std::vector<Contact> contacts;
  std::vector<Vec3> outward;
  PenaltyLaw law{3e6, 4e4};
  Twist twist;

  explicit Motion(Random& random) {
    twist = {random_vector(random, 0.1), random_vector(random, 0.2), random_vector(random, 2)};
    for (int i = 0; i < 20; ++i) {
      Contact c;
      c.position = random_vector(random, 0.1);
      c.inward_normal = random_direction(random);
      c.penetration = static_cast<float>(random.between(0, 0.004));
      c.area = static_cast<float>(random.between(1e-6, 1e-5));
      contacts.push_back(c);
      outward.push_back(random_direction(random));
    }
  }
  std::array<double, 6> after(Vec3 shift, Vec3 angle) const {
    std::vector<Contact> moved = contacts;
    Twist at = twist;
    at.centre = plus(twist.centre, shift, 1);
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const Vec3 arm = plus(moved[i].position, twist.centre, -1);
      const Vec3 step = plus(shift, cross(angle, arm), 1);
      moved[i].position = plus(moved[i].position, step, 1);
      moved[i].inward_normal = plus(moved[i].inward_normal, cross(angle, moved[i].inward_normal), 1);
      moved[i].penetration -= static_cast<float>(dot(outward[i], step));
    }
    return six(wrench(moved, law, at));
  }
  std::array<double, 6> with(Vec3 linear, Vec3 angular) const {
    Twist at = twist;
    at.linear = plus(twist.linear, linear, 1);
    at.angular = plus(twist.angular, angular, 1);
    return six(wrench(contacts, law, at));
  }
};

void expect_gradient(const double (&gradient)[36], float step,
                     const std::function<std::array<double, 6>(Vec3, Vec3)>& wrench_after) {
  double size[4] = {};  // of the blocks
  for (std::size_t i = 0; i < 36; ++i) {
    double& s = size[i / 18 * 2 + i % 6 / 3];
    s = std::max(s, std::abs(gradient[i]));
  }
  for (std::size_t column = 0; column < 6; ++column) {
    float change[6] = {};
    change[column] = step;
    const auto forth = wrench_after({change[0], change[1], change[2]}, {change[3], change[4], change[5]});
    const auto back = wrench_after({-change[0], -change[1], -change[2]}, {-change[3], -change[4], -change[5]});
    for (std::size_t row = 0; row < 6; ++row) {
      const double expected = (forth[row] - back[row]) / (2 * step);
      EXPECT_NEAR(gradient[6 * row + column], expected, 0.01 * size[row / 3 * 2 + column / 3])
          << row << " by " << column;
    }
  }
}

TEST(Penalty, ItsGradientIsTheDifferenceOfItsForces) {
  Random random;
  int pressing = 0;
  for (int n = 0; n < 20; ++n) {
    Motion motion(random);
    // Avoids the kinks of the law, where it has no gradient.
    std::erase_if(motion.contacts, [&](const Contact& c) {
      const Vec3 arm = plus(c.position, motion.twist.centre, -1);
      const Vec3 velocity = plus(motion.twist.linear, cross(motion.twist.angular, arm), 1);
      return std::abs(motion.law.stiffness * c.penetration - motion.law.damping * dot(velocity, c.inward_normal)) <
                 400 ||
             c.penetration < 1e-4F;
    });
    motion.outward.resize(motion.contacts.size());
    WrenchGradient gradient;
    ASSERT_EQ(penalty_gradient(motion.contacts, motion.outward, motion.law, motion.twist, gradient), Status::ok);
    expect_gradient(gradient.pose, 1e-5F, [&](Vec3 a, Vec3 b) { return motion.after(a, b); });
    expect_gradient(gradient.twist, 1e-4F, [&](Vec3 a, Vec3 b) { return motion.with(a, b); });
    pressing += static_cast<int>(motion.contacts.size());
  }
  EXPECT_GT(pressing, 100);
}

TEST(Penalty, ItsGradientIsThatOfWholeQueries) {
  // A sphere's field and a sphere's shell, queried again after each small step.
  Pair s;
  const SphereField field{0.06F};
  const Pose pose = pose_at(0.05, -0.02, 0.03);
  const auto query = [&](Vec3 shift, Vec3 angle) {
    // About the asset's origin, which is not the sphere's centre.
    Pose moved;
    const float a[3] = {angle.x, angle.y, angle.z};
    const double t = std::sqrt(dot(angle, angle));
    for (int i = 0; i < 3 && t > 0; ++i) {
      const int j = (i + 1) % 3;
      const int k = (i + 2) % 3;
      if (a[i] == 0) continue;
      const double signed_angle = a[i];
      moved.rotation[4 * j] = moved.rotation[4 * k] = std::cos(signed_angle);
      moved.rotation[3 * j + k] = -std::sin(signed_angle);
      moved.rotation[3 * k + j] = std::sin(signed_angle);
    }
    const float by[3] = {shift.x, shift.y, shift.z};
    for (int i = 0; i < 3; ++i) moved.translation[i] = pose.translation[i] + by[i];
    QueryResult result;
    EXPECT_EQ(traverse(s.shell, field, moved, {}, s.scratch, s.contacts, result), Status::ok);
    return result;
  };
  const auto twist_at = [&](Vec3 shift) {
    Twist twist;
    twist.centre = plus({0.05F, -0.02F, 0.03F}, shift, 1);
    return twist;
  };
  const auto wrench_after = [&](Vec3 shift, Vec3 angle) {
    const QueryResult result = query(shift, angle);
    return six(wrench(std::span(s.contacts).first(result.contacts), kSpring, twist_at(shift)));
  };
  const QueryResult result = query({}, {});
  ASSERT_GT(result.contacts, 50U);
  const std::span<const Contact> contacts = std::span(s.contacts).first(result.contacts);
  std::vector<Vec3> outward;
  for (const Contact& c : contacts) outward.push_back(outward_normal(field, c.position));
  WrenchGradient gradient;
  ASSERT_EQ(penalty_gradient(contacts, outward, kSpring, twist_at({}), gradient), Status::ok);
  double size[4] = {};
  for (std::size_t i = 0; i < 36; ++i) {
    double& block = size[i / 18 * 2 + i % 6 / 3];
    block = std::max(block, std::abs(gradient.pose[i]));
  }
  constexpr float kStep = 2e-5F;
  for (std::size_t column = 0; column < 6; ++column) {
    float change[6] = {};
    change[column] = column < 3 ? kStep : kStep / 0.05F;
    const auto forth = wrench_after({change[0], change[1], change[2]}, {change[3], change[4], change[5]});
    const auto back = wrench_after({-change[0], -change[1], -change[2]}, {-change[3], -change[4], -change[5]});
    for (std::size_t row = 0; row < 6; ++row) {
      const double expected = (forth[row] - back[row]) / (2 * change[column]);
      EXPECT_NEAR(gradient.pose[6 * row + column], expected, 0.02 * size[row / 3 * 2 + column / 3])
          << row << " by " << column;
    }
  }
  EXPECT_LT(gradient.pose[14], 0) << "deeper pushes harder";
}

TEST(Penalty, DampingTakesEnergyAndNeverPulls) {
  Random random;
  for (int n = 0; n < 200; ++n) {
    const Motion motion(random);
    const auto power = [&](const std::array<double, 6>& w) {
      return w[0] * motion.twist.linear.x + w[1] * motion.twist.linear.y + w[2] * motion.twist.linear.z +
             w[3] * motion.twist.angular.x + w[4] * motion.twist.angular.y + w[5] * motion.twist.angular.z;
    };
    const auto damped = six(wrench(motion.contacts, motion.law, motion.twist));
    const auto elastic = six(wrench(motion.contacts, {motion.law.stiffness, 0}, motion.twist));
    ASSERT_LE(power(damped), power(elastic) + 1e-9);
    for (const Contact& c : motion.contacts) {
      const Wrench one = wrench({&c, 1}, motion.law, motion.twist);
      ASSERT_GE(one.force[0] * c.inward_normal.x + one.force[1] * c.inward_normal.y + one.force[2] * c.inward_normal.z,
                0);
    }
    WrenchGradient gradient;
    ASSERT_EQ(penalty_gradient(motion.contacts, {}, motion.law, motion.twist, gradient), Status::ok);
    double taken = 0;
    const Vec3 a = random_vector(random, 1);
    const Vec3 b = random_vector(random, 1);
    const double change[6] = {a.x, a.y, a.z, b.x, b.y, b.z};
    for (std::size_t i = 0; i < 36; ++i) taken += change[i / 6] * gradient.twist[i] * change[i % 6];
    ASSERT_LE(taken, 1e-12);
  }
}

TEST(Penalty, BadUseGetsAStatus) {
  const Contact contact{{0, 0, 0}, {0, 0, 1}, 0.001F, 1e-6F, 0, 0};
  const std::span<const Contact> one(&contact, 1);
  Wrench out;
  out.force[0] = 42;
  EXPECT_EQ(penalty_wrench(one, {-1, 0}, {}, out), Status::bad_argument);
  EXPECT_EQ(out.force[0], 0);
  EXPECT_EQ(penalty_wrench(one, {1, std::nan("")}, {}, out), Status::bad_argument);
  EXPECT_EQ(penalty_wrench(one, {1, -1}, {}, out), Status::bad_argument);
  Twist twist;
  twist.angular.y = std::numeric_limits<float>::infinity();
  EXPECT_EQ(penalty_wrench(one, {1, 1}, twist, out), Status::bad_argument);
  EXPECT_EQ(penalty_wrench({}, {1, 1}, {}, out), Status::ok);
  WrenchGradient gradient;
  const Vec3 two[2] = {};
  EXPECT_EQ(penalty_gradient(one, two, {1, 1}, {}, gradient), Status::bad_argument);
  EXPECT_EQ(penalty_gradient(one, {}, {-1, 1}, {}, gradient), Status::bad_argument);
}

}  // namespace
}  // namespace vps::test

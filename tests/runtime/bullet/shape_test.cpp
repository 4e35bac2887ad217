// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/bullet/choose_four.h"
#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

TEST(Shape, BoundsAndInertiaAreThoseOfTheBody) {
  // The box is off-centre in its own frame: the shape's origin moves to the centre of mass.
  const auto asset = baked_at(make_box({0.05, 0.04, 0.03}, {0.2, 0, -0.1}), 0.005);
  const bullet::Shape shape(asset);
  EXPECT_NEAR(shape.centre_of_mass().x(), 0.2, 1e-6);
  EXPECT_NEAR(shape.centre_of_mass().z(), -0.1, 1e-6);
  btVector3 low, high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  EXPECT_NEAR(low.x(), -0.05, 1e-6);
  EXPECT_NEAR(high.z(), 0.03, 1e-6);
  shape.getAabb(btTransform(btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI), {1, 0, 0}), low, high);
  EXPECT_NEAR(high.x(), 1.04, 1e-5);
  EXPECT_NEAR(high.y(), 0.05, 1e-5);
  btVector3 inertia;
  shape.calculateLocalInertia(2, inertia);
  EXPECT_NEAR(inertia.x(), 2 * (0.08 * 0.08 + 0.06 * 0.06) / 12, 1e-7);
  EXPECT_NEAR(inertia.y(), 2 * (0.1 * 0.1 + 0.06 * 0.06) / 12, 1e-7);
  EXPECT_NEAR(inertia.z(), 2 * (0.1 * 0.1 + 0.08 * 0.08) / 12, 1e-7);
}

TEST(Shape, SitsInASlotThatBulletTreatsAsConcaveAndCastsNowhere) {
  const bullet::Shape shape(baked_at(make_sphere(0.05, 3), 0.01));
  EXPECT_EQ(shape.getShapeType(), FAST_CONCAVE_MESH_PROXYTYPE);
  EXPECT_NE(shape.getShapeType(), SDF_SHAPE_PROXYTYPE);
  EXPECT_TRUE(shape.isConcave());
}

TEST(Shape, ScalingIsRefusedAndSaid) {
  bullet::Shape shape(baked_at(make_sphere(0.05, 3), 0.01));
  shape.setLocalScaling({1, 1, 1});
  EXPECT_EQ(shape.status(), Status::ok);
  shape.setLocalScaling({2, 2, 2});
  EXPECT_EQ(shape.status(), Status::bad_argument);
  EXPECT_EQ(shape.getLocalScaling().x(), 1);
}

TEST(Shape, SegmentLevelIsTheOneWithTheNearestNumberOfClusters) {
  bullet::Shape shape(baked_at(make_sphere(0.05, 4), 0.003));
  EXPECT_EQ(shape.segment_level(), 0U);
  shape.set_segments(1);
  EXPECT_EQ(shape.segment_level(), 1U);
  shape.set_segments(1000000);
  EXPECT_EQ(shape.segment_level(), shape.pointshell().levels);
}

std::vector<Contact> contacts_at(const std::vector<std::array<float, 3>>& points) {
  std::vector<Contact> contacts;
  for (const auto& [x, y, depth] : points) {
    Contact c;
    c.position = {x, y, 0};
    c.penetration = depth;
    c.point = static_cast<std::uint32_t>(contacts.size());
    contacts.push_back(c);
  }
  return contacts;
}

TEST(ChooseFour, KeepsTheDeepestAndTheCorners) {
  std::vector<std::array<float, 3>> grid;
  for (int i = 0; i < 11; ++i) {
    for (int j = 0; j < 11; ++j) grid.push_back({static_cast<float>(i), static_cast<float>(j), 0});
  }
  grid[3 * 11 + 4][2] = 1;
  const auto contacts = contacts_at(grid);
  std::array<std::uint32_t, 4> chosen{};
  ASSERT_EQ(bullet::choose_four(contacts, {}, {}, 0, chosen), 4U);
  EXPECT_EQ(chosen[0], 3U * 11 + 4);
  for (int k = 1; k < 4; ++k) {
    const Vec3 p = contacts[chosen[static_cast<std::size_t>(k)]].position;
    EXPECT_TRUE((p.x == 0 || p.x == 10) && (p.y == 0 || p.y == 10)) << p.x << ' ' << p.y;
  }
}

TEST(ChooseFour, FewOrDegenerateContactsGiveFewerPoints) {
  std::array<std::uint32_t, 4> chosen{};
  EXPECT_EQ(bullet::choose_four({}, {}, {}, 0, chosen), 0U);
  EXPECT_EQ(bullet::choose_four(contacts_at({{1, 1, 0}}), {}, {}, 0, chosen), 1U);
  EXPECT_EQ(bullet::choose_four(contacts_at({{1, 1, 0}, {1, 1, 0}}), {}, {}, 0, chosen), 1U);
  EXPECT_EQ(bullet::choose_four(contacts_at({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}), {}, {}, 0, chosen), 2U);
  EXPECT_EQ(bullet::choose_four(contacts_at({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), {}, {}, 0, chosen), 3U);
}

TEST(ChooseFour, APointOfTheStepBeforeIsKeptWhileItIsNearlyAsGood) {
  const auto contacts = contacts_at({{0, 0, 1}, {10, 0, 0}, {10.1F, 0.1F, 0}, {0, 5, 0}});
  std::array<std::uint32_t, 4> chosen{};
  ASSERT_GE(bullet::choose_four(contacts, {}, {}, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 2U);
  const std::array<std::uint32_t, 1> previous = {1};
  ASSERT_GE(bullet::choose_four(contacts, {}, previous, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 1U);
}

TEST(ChooseFour, AContactIsRecognisedByItsFeatureNotByItsPoint) {
  auto contacts = contacts_at({{0, 0, 1}, {10, 0, 0}, {10.1F, 0.1F, 0}, {0, 5, 0}});
  for (Contact& contact : contacts) contact.point = 1;  // corners of triangles beside the same point of the shell
  const std::array<std::uint32_t, 4> features = {100, 101, 102, 103};
  const std::array<std::uint32_t, 1> previous = {101};
  std::array<std::uint32_t, 4> chosen{};
  ASSERT_GE(bullet::choose_four(contacts, features, previous, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 1U);
  const std::array<std::uint32_t, 1> point = {1};
  ASSERT_GE(bullet::choose_four(contacts, features, point, 0, chosen), 2U);
  EXPECT_EQ(chosen[1], 2U);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/segment_contacts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "runtime/bullet/partners/partner.h"
#include "runtime/contacts/arriving_contacts.h"
#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

using detail::keep_segments;
using detail::SegmentMemory;
using detail::SegmentPoint;

constexpr float kBeside = 0.1F;
constexpr float kAlike = 1e-4F;

detail::ManifoldContact contact(std::uint32_t node, std::uint32_t point, float x, float penetration) {
  detail::ManifoldContact out;
  out.node = node;
  out.point = point;
  out.feature = point;
  out.position = {x, 0, 0};
  out.penetration = penetration;
  return out;
}

std::vector<std::uint32_t> points_of(std::span<const SegmentPoint> kept) {
  std::vector<std::uint32_t> out;
  for (const SegmentPoint& one : kept) out.push_back(one.point);
  return out;
}

using Points = std::vector<std::uint32_t>;

TEST(SegmentContacts, WhatASegmentTouchedWithStaysInItsPlaceBesideANewDeepestPoint) {
  SegmentMemory memory;
  const std::vector<detail::ManifoldContact> first = {contact(3, 10, 0, 0), contact(5, 20, 0, 0)};
  EXPECT_EQ(points_of(keep_segments(first, kBeside, kAlike, memory)), (Points{10, 20}));
  const std::vector<detail::ManifoldContact> second = {contact(3, 10, 0, -1e-3F), contact(3, 11, 1, 0),
                                                       contact(5, 20, 0, 0)};
  const auto kept = keep_segments(second, kBeside, kAlike, memory);
  EXPECT_EQ(points_of(kept), (Points{10, 11, 20}));
  EXPECT_EQ(kept[0].place, 0);
  EXPECT_EQ(kept[1].place, 1);
  EXPECT_EQ(kept[1].at, &second[1]);
  EXPECT_EQ(kept[2].place, 0);
}

TEST(SegmentContacts, WhatIsNotFoundAnyMoreIsForgottenAndTheOthersKeepTheirPlaces) {
  SegmentMemory memory;
  const std::vector<detail::ManifoldContact> both = {contact(3, 10, 0, -1e-3F), contact(3, 11, 1, 0)};
  (void)keep_segments(std::span(both).first(1), kBeside, kAlike, memory);
  (void)keep_segments(both, kBeside, kAlike, memory);
  const std::vector<detail::ManifoldContact> one = {contact(3, 11, 1, 0)};
  const auto kept = keep_segments(one, kBeside, kAlike, memory);
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_EQ(kept[0].point, 11U);
  EXPECT_EQ(kept[0].place, 1);
  EXPECT_TRUE(keep_segments({}, kBeside, kAlike, memory).empty());
}

TEST(SegmentContacts, ANewPointTakesThePlaceOfTheOneBesideItElseOfTheLeastDeep) {
  SegmentMemory memory;
  std::vector<detail::ManifoldContact> contacts;
  for (const std::uint32_t i : {0U, 1U, 2U}) {
    contacts.push_back(contact(3, i, static_cast<float>(i), i == 1 ? -2e-3F : -1e-3F));
    (void)keep_segments(contacts, kBeside, kAlike, memory);
  }
  contacts.push_back(contact(3, 7, 0.05F, 0));
  EXPECT_EQ(points_of(keep_segments(contacts, kBeside, kAlike, memory)), (Points{7, 1, 2}));
  contacts = {contact(3, 1, 1, -2e-3F), contact(3, 2, 2, -1e-3F), contact(3, 7, 0, -1e-3F), contact(3, 8, 5, 0)};
  EXPECT_EQ(points_of(keep_segments(contacts, kBeside, kAlike, memory)), (Points{7, 8, 2}));
}

TEST(SegmentContacts, APointThatIsHardlyDeeperTakesNoPlace) {
  SegmentMemory memory;
  std::vector<detail::ManifoldContact> contacts;
  for (const std::uint32_t i : {0U, 1U, 2U}) {
    contacts.push_back(contact(3, i, static_cast<float>(i), -1e-3F));
    (void)keep_segments(contacts, kBeside, kAlike, memory);
  }
  contacts.push_back(contact(3, 7, 5, -1e-3F + 0.9F * kAlike));
  EXPECT_EQ(points_of(keep_segments(contacts, kBeside, kAlike, memory)), (Points{0, 1, 2}));
  contacts.back().penetration = -1e-3F + 1.1F * kAlike;
  EXPECT_EQ(points_of(keep_segments(contacts, kBeside, kAlike, memory)), (Points{7, 1, 2}));
}

TEST(SegmentContacts, CornersBesideTheSamePointOfTheShellAreDifferentContacts) {
  SegmentMemory memory;
  std::vector<detail::ManifoldContact> corners = {contact(3, 10, 0, 0), contact(3, 10, 1, 0)};
  corners[0].feature = 100;
  corners[1].feature = 101;
  (void)keep_segments(std::span(corners).first(1), kBeside, kAlike, memory);
  const auto kept = keep_segments(corners, kBeside, kAlike, memory);
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].at, &corners[0]);
  EXPECT_EQ(kept[1].at, &corners[1]);
  EXPECT_EQ(points_of(kept), (Points{10, 10}));
}

TEST(SegmentContacts, AnotherShellOrLevelForgetsAll) {
  SegmentMemory memory;
  const std::uint16_t codes[1] = {};
  PointshellView shell;
  shell.position[0] = codes;
  shell.points = 100;
  const std::vector<detail::ManifoldContact> contacts = {contact(3, 10, 0, 0)};
  const auto is_kept = [&](const PointshellView& of_shell, std::uint32_t level) {
    (void)keep_segments(contacts, kBeside, kAlike, memory);
    memory.belong_to(of_shell, level);
    return !memory.points.empty();
  };
  memory.belong_to(shell, 2);
  EXPECT_TRUE(is_kept(shell, 2));
  EXPECT_FALSE(is_kept(shell, 3));
  EXPECT_FALSE(is_kept(shell, 0));
  shell.points = 10;  // point 10 does not exist
  memory.belong_to(shell, 2);
  shell.points = 11;
  EXPECT_FALSE(is_kept(shell, 2));
}

TEST(SegmentContacts, ABodyIsLandingWhereItMovesFartherThanFromRestInFiveSteps) {
  World scene;
  bullet::Shape shape(baked_at(make_box({0.05, 0.05, 0.05}), 0.004));
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btRigidBody& floor = scene.add(plane, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, 1});
  body.applyGravity();
  const auto approach = [&](double speed, double rate = 30) {
    body.setLinearVelocity({0, 0, btScalar(-speed)});
    const bullet::Pair pair{bullet::PairBody(&shape, &body, body.getWorldTransform()),
                            bullet::PairBody(&plane, &floor, floor.getWorldTransform())};
    return step_of(pair.shell, pair.field, btScalar(1 / rate), 0, bullet::LookAhead::yes).query.approach;
  };
  // In a step a body falls 10.9 mm, five times that is 54.5 mm; a voxel is 4 mm.
  EXPECT_NEAR(approach(0).way, 0.0109, 1e-4);
  EXPECT_EQ(approach(0).phase, detail::Approach::Phase::resting);
  EXPECT_EQ(approach(1.4).phase, detail::Approach::Phase::resting);
  EXPECT_EQ(approach(1.5).phase, detail::Approach::Phase::landing);
  EXPECT_NEAR(approach(1.5).way, 0.0609, 1e-4);
  // At 40 Hz it falls 6.1 mm, less than two voxels.
  EXPECT_EQ(approach(0, 40).phase, detail::Approach::Phase::still);
  EXPECT_EQ(approach(0.15, 40).phase, detail::Approach::Phase::still);
  EXPECT_EQ(approach(0.17, 40).phase, detail::Approach::Phase::resting);
  // Bodies that bounce, faster than Bullet's threshold of 0.2 m/s, have no contacts ahead.
  body.setRestitution(1);
  floor.setRestitution(1);
  EXPECT_NEAR(approach(0.19).way, 0.19 / 30 + 0.0109, 1e-4);
  EXPECT_EQ(approach(0.21).way, 0);
}

// Whether the body of a pair's only contact rolls. The contact arrives in the step.
bool rolls(const bullet::Pair& pair, Contact contact) {
  const bullet::PairStep step = step_of(pair.shell, pair.field, btScalar(1.0 / 60), 0, bullet::LookAhead::yes);
  const detail::StepPair of_step = bullet::in_step(pair, &step);
  bullet::PairPartner partner;
  detail::FoundContacts found;
  found.contacts = {&contact, 1};
  detail::keep_arriving(of_step, *partner.of(pair, true), found);
  EXPECT_EQ(found.contacts.size(), 1U);
  return found.rolling.reach > 0;
}

// A static body gives the points, and Bullet's cylinder falls on it with little spin, here or far from the origin.
TEST(SegmentContacts, WhetherABodyRollsDoesNotDependOnTheOrigin) {
  for (const double far : {0.0, 50.0}) {
    World scene;
    bullet::Shape slab(baked_at(make_box({0.2, 0.2, 0.05}), 0.01));
    btCylinderShapeX wheel({btScalar(0.02), btScalar(0.05), btScalar(0.05)});
    btRigidBody& floor = scene.add(slab, 0, {btScalar(far), 0, btScalar(-0.05)});
    btRigidBody& body = scene.add(wheel, 1, {btScalar(far), 0, btScalar(0.05)});
    const bullet::Pair pair{bullet::PairBody(&slab, &floor, floor.getWorldTransform()),
                            bullet::PairBody(&wheel, &body, body.getWorldTransform())};
    Contact contact;
    const btTransform to_field = bullet::field_frame(pair.field).inverse();
    contact.position = bullet::to_vec3(to_field * btVector3(0, 0, btScalar(-0.05)));
    contact.inward_normal = bullet::to_vec3(to_field * btVector3(0, 0, -1));
    for (const double spin : {1.0, 100.0}) {
      body.setLinearVelocity({0, 0, -1});
      body.setAngularVelocity({btScalar(spin), 0, 0});
      EXPECT_EQ(rolls(pair, contact), spin > 50) << far;
    }
  }
}

// An end of a bar hardly falls, as the bar spins. Where its middle falls far, the bar lands.
TEST(SegmentContacts, ABodyThatSpinsAsItLandsDoesNotRoll) {
  World scene;
  bullet::Shape slab(baked_at(make_box({0.2, 0.4, 0.05}), 0.01));
  btBoxShape bar({btScalar(0.02), btScalar(0.3), btScalar(0.02)});
  btRigidBody& floor = scene.add(slab, 0, {0, 0, btScalar(-0.05)});
  btRigidBody& body = scene.add(bar, 1, {0, 0, btScalar(0.02)});
  const bullet::Pair pair{bullet::PairBody(&slab, &floor, floor.getWorldTransform()),
                          bullet::PairBody(&bar, &body, body.getWorldTransform())};
  constexpr float kEnd = 0.29F;
  for (const double speed : {1.0, 8.0}) {
    body.setLinearVelocity({0, 0, btScalar(-speed)});
    body.setAngularVelocity({btScalar(speed / double{kEnd}), 0, 0});
    Contact contact;
    contact.position = {0, kEnd, -0.02F};
    contact.inward_normal = {0, 0, -1};
    EXPECT_EQ(rolls(pair, contact), speed < 5);
  }
}

// A bar stands on one end like a wheel that rolls. In a step its other end comes down through a thin plate.
TEST(SegmentContacts, TheFarEndOfABarThatSlapsDownDoesNotRollPast) {
  const btVector3 half(btScalar(0.1), btScalar(0.005), btScalar(0.003));
  bullet::Shape bar(baked_at(make_box({0.1, 0.005, 0.003}), 0.002));
  btBoxShape plate({1, 1, btScalar(0.002)});
  const auto lowest_of = [&](const btTransform& pose) {
    return double(pose.getOrigin().z() - pose.getBasis()[2].absolute().dot(half));
  };
  for (const double about_x : {0.0, 0.3, 0.6}) {
    for (const double tilt : {0.1, 0.15, 0.2}) {
      World scene;
      scene.add(plate, 0, {0, 0, btScalar(-0.002)});
      btTransform pose(btQuaternion({0, 1, 0}, btScalar(-tilt)) * btQuaternion({1, 0, 0}, btScalar(about_x)));
      pose.getOrigin().setZ(btScalar(0.0003 - lowest_of(pose)));
      btRigidBody& body = scene.add(bar, btScalar(0.05), pose);
      body.setLinearVelocity({0, 0, btScalar(-1.2)});
      body.setAngularVelocity({0, 12, 0});
      double lowest = 0;
      for (int i = 0; i < 10; ++i) {
        scene.step(1, btScalar(1.0 / 60));
        lowest = std::min(lowest, lowest_of(body.getWorldTransform()));
      }
      EXPECT_GT(lowest, -0.003) << about_x << ", " << tilt;
    }
  }
}

// The normal of a point at an edge lies between those of two faces: along it the edge seems to fall less than it does.
TEST(SegmentContacts, HowFarABodyFallsIsMeasuredAlongItsPartnersNormal) {
  World scene;
  bullet::Shape slab(baked_at(make_box({0.2, 0.2, 0.05}), 0.01));
  btStaticPlaneShape plane({0, 0, 1}, 0);
  btRigidBody& floor = scene.add(plane, 0, {0, 0, 0});
  btRigidBody& body = scene.add(slab, 1, {0, 0, btScalar(0.05)});
  body.setLinearVelocity({0, 0, btScalar(-0.3)});
  body.setAngularVelocity({-5, 0, 0});
  const bullet::Pair pair{bullet::PairBody(&slab, &body, body.getWorldTransform()),
                          bullet::PairBody(&plane, &floor, floor.getWorldTransform())};
  Contact at_edge;
  at_edge.position = {0, -0.2F, 0};
  at_edge.inward_normal = {0, 0, 1};
  EXPECT_TRUE(rolls(pair, at_edge));  // this edge rises
  at_edge.position = {0, 0.2F, 0};
  EXPECT_FALSE(rolls(pair, at_edge));
  at_edge.inward_normal = {0, -0.8F, 0.6F};
  EXPECT_FALSE(rolls(pair, at_edge));
}

// A ball with dents and bumps.
const std::shared_ptr<Asset>& uneven() {
  static const auto asset = [] {
    TriangleMesh mesh = make_sphere(0.05, 5);
    for (auto& [x, y, z] : mesh.vertices) {
      const double bump = 1 + 0.03 * std::sin(200 * x) * std::sin(170 * y + 1) + 0.03 * std::sin(150 * z + 2);
      x *= bump, y *= bump, z *= 0.5 * bump;
    }
    return baked_at(mesh, 0.0005);
  }();
  return asset;
}

TEST(SegmentContacts, MoreThanTheDeepestIsKeptWhereASegmentTouchesAndTheBodyIsNotLanding) {
  World scene;
  bullet::Shape shape(uneven());
  shape.set_segments(1);
  btStaticPlaneShape plane({0, 0, 1}, 0);
  scene.add(plane, 0, {0, 0, 0});
  btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.04)});
  scene.step(600, btScalar(1.0 / 60));
  const btTransform rest = body.getWorldTransform();
  const auto contacts_at = [&](double height, double speed) {
    body.setWorldTransform(rest);
    body.setLinearVelocity({0, 0, 0});
    body.setAngularVelocity({0, 0, 0});
    scene.step(60, btScalar(1.0 / 60));
    body.getWorldTransform().getOrigin() += btVector3(0, 0, btScalar(height));
    body.setLinearVelocity({0, 0, btScalar(-speed)});
    body.setAngularVelocity({0, 0, 0});
    body.applyGravity();
    scene.world.performDiscreteCollisionDetection();
    body.clearForces();
    return scene.points().size();
  };
  EXPECT_GT(contacts_at(0, 0), 1U);
  EXPECT_EQ(contacts_at(0, 5), 1U);
  // In a step a body falls 2.7 mm, with 0.1 m/s it moves 4.4 mm; eight voxels are 4 mm.
  EXPECT_GT(contacts_at(0.001, 0), 1U);
  EXPECT_EQ(contacts_at(0.0042, 0.1), 1U);
}

TEST(SegmentContacts, AnUnevenBodyComesToRestAtLowRates) {
  for (const double rate : {120.0, 60.0, 30.0}) {
    for (const std::uint32_t segments : {0U, 15U}) {
      World scene;
      scene.world.getSolverInfo().m_numIterations = 50;
      // With one friction direction a body may turn about the normal for ever, here at 25 mrad/s.
      scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
      bullet::Shape shape(uneven());
      shape.set_segments(segments);
      btStaticPlaneShape plane({0, 0, 1}, 0);
      scene.add(plane, 0, {0, 0, 0});
      btRigidBody& body = scene.add(shape, 1, {0, 0, btScalar(0.06)});
      scene.step(static_cast<int>(12 * rate), btScalar(1 / rate));
      double fastest = 0;
      for (int i = 0; i < static_cast<int>(3 * rate); ++i) {
        scene.step(1, btScalar(1 / rate));
        fastest = std::max(fastest, speed(body));
      }
      EXPECT_LT(fastest, 2e-4) << rate << " Hz, " << segments << " segments";
    }
  }
}

}  // namespace
}  // namespace vps::test

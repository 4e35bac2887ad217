// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/slide_to_deepest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <vector>

#include "runtime/contacts/between_samples.h"
#include "sample_meshes/shapes.h"
#include "tests/support/baked.h"

namespace vps::test {
namespace {

using namespace detail;
using namespace samples;

constexpr float kRadius = 0.05F;
constexpr float kVoxel = kRadius / 32;
constexpr float kRing = 4 * kVoxel;

std::shared_ptr<Asset> body(const TriangleMesh& mesh) {
  bake::BakeOptions options;
  options.voxel_size = kVoxel;
  return baked(mesh, options);
}

VoxelmapView map_of(const Asset& asset) {
  VoxelmapView map;
  EXPECT_EQ(asset.voxelmap(map), Status::ok);
  return map;
}

// A body on the plane z = 0, whose asset frame lies at a height.
struct OnPlane {
  VoxelmapView map;
  HalfSpaceField solid;
  PlacedField shell, plane;
  OnPlane(const Asset& asset, float height) : map(map_of(asset)), shell(map, at(height)), plane(solid, Pose()) {}
  [[nodiscard]] TouchingBodies bodies() const { return {shell, plane, kVoxel}; }
  [[nodiscard]] Slide slide(Contact& contact) const {
    Slide result{};
    Slider slider{&contact, &result, {kRing, nullptr}};
    slide_to_deepest(bodies(), {&slider, 1});
    return result;
  }
  static Pose at(float height) {
    Pose pose;
    pose.translation[2] = -height;
    return pose;
  }
};

Contact contact_at(Vec3 position) {
  Contact contact;
  contact.position = position;
  contact.inward_normal = {0, 0, 1};
  contact.penetration = -position.z;
  return contact;
}

TEST(SlideToDeepest, SamplesOfABallEndAtItsLowestPoint) {
  const auto ball = body(make_sphere(kRadius, 5));
  const float depth = 0.2F * kVoxel;
  const OnPlane on(*ball, kRadius - depth);
  for (const float way_vx : {0.5F, 1.0F, 2.0F, 3.0F}) {
    for (int i = 0; i < 16; ++i) {
      const auto angle = static_cast<float>(0.1 + i * 0.39);
      const float r = way_vx * kVoxel;
      Contact contact = contact_at(
          {r * std::cos(angle), r * std::sin(angle), kRadius - depth - std::sqrt(kRadius * kRadius - r * r)});
      EXPECT_EQ(on.slide(contact), Slide::arrived) << way_vx;
      EXPECT_LT(std::hypot(contact.position.x, contact.position.y), 0.4F * kVoxel) << way_vx;
      EXPECT_NEAR(contact.penetration, depth, 0.05F * kVoxel) << way_vx;
      EXPECT_GT(contact.inward_normal.z, 0.9999F) << way_vx;
    }
  }
}

TEST(SlideToDeepest, ASampleFarUpABallSlopes) {
  const auto ball = body(make_sphere(kRadius, 5));
  const OnPlane on(*ball, kRadius);
  for (const float degrees : {20.0F, 30.0F}) {
    const float angle = degrees * 0.01745F;
    Contact contact = contact_at({kRadius * std::sin(angle), 0, kRadius * (1 - std::cos(angle))});
    EXPECT_TRUE(is_steep(on.bodies(), contact));
    EXPECT_EQ(on.slide(contact), Slide::sloping) << degrees;
  }
}

// One slide takes it a ring at most.
TEST(SlideToDeepest, TheDeepestContactGoesOnRingByRing) {
  const auto ball = body(make_sphere(kRadius, 5));
  const OnPlane on(*ball, kRadius);
  for (const float way_vx : {6.0F, 8.0F, 10.0F}) {
    const float r = way_vx * kVoxel;
    Contact contact = contact_at({r, 0, kRadius - std::sqrt(kRadius * kRadius - r * r)});
    SlidingContact sliding{&contact};
    Slides slides({kVoxel}, {&sliding, 1}, nullptr);
    slides.search(on.bodies());
    EXPECT_EQ(sliding.slide, Slide::arrived) << way_vx;
    EXPECT_LT(std::hypot(contact.position.x, contact.position.y), 0.4F * kVoxel) << way_vx;
    EXPECT_NEAR(contact.penetration, 0, 0.05F * kVoxel) << way_vx;
  }
}

// Contacts of a ball: `kind` of all but the deepest, which comes `last` or first.
std::vector<bool> kept_of(const OnPlane& on, std::span<const Vec3> places, SlidingContact::Kind kind, bool last) {
  std::vector<Contact> contacts;
  std::transform(places.begin(), places.end(), std::back_inserter(contacts), contact_at);
  if (last) std::reverse(contacts.begin(), contacts.end());
  std::vector<SlidingContact> sliding;
  for (Contact& contact : contacts) sliding.push_back({&contact, 0, kind});
  (last ? sliding.back() : sliding.front()).kind = SlidingContact::Kind::touching;
  Slides slides({kVoxel}, sliding, nullptr);
  slides.recall();
  slides.search(on.bodies());
  slides.keep();
  if (last) std::reverse(sliding.begin(), sliding.end());
  std::vector<bool> kept;
  for (const SlidingContact& one : sliding) kept.push_back(one.is_kept);
  return kept;
}

TEST(SlideToDeepest, OneContactRemainsOfThoseThatMeetWhereOneMoved) {
  const auto ball = body(make_sphere(kRadius, 5));
  const float depth = 0.2F * kVoxel;
  const OnPlane on(*ball, kRadius - depth);
  const auto on_ball = [=](float x_vx, float y_vx) {
    const float x = x_vx * kVoxel;
    const float y = y_vx * kVoxel;
    return Vec3{x, y, kRadius - depth - std::sqrt(kRadius * kRadius - x * x - y * y)};
  };
  // The first is the deepest, and slides to the middle. The second lies there, the last two are farther off than a
  // ring, and beside each other.
  const Vec3 places[] = {on_ball(1, 0), on_ball(0, -1.5F), on_ball(6, 0), on_ball(6, 0.5F)};
  for (const bool last : {false, true}) {
    EXPECT_EQ(kept_of(on, places, SlidingContact::Kind::fixed, last), (std::vector{true, false, true, true})) << last;
    EXPECT_EQ(kept_of(on, std::span(places).first(2), SlidingContact::Kind::touching, last), (std::vector{true, false}))
        << last;
  }
}

TEST(SlideToDeepest, ACubeKeepsItsFacesAndCorners) {
  const auto cube = body(make_box({kRadius, kRadius, kRadius}));
  const OnPlane on(*cube, kRadius);
  for (const float place : {0.0F, 0.5F, 0.9F, 0.97F, 1.0F}) {
    const Vec3 start{place * kRadius, 0.3F * kRadius, 0};
    Contact contact = contact_at(start);
    EXPECT_FALSE(is_steep(on.bodies(), contact));
    EXPECT_NE(on.slide(contact), Slide::sloping) << place;
    EXPECT_LT(length(contact.position - start), 0.3F * kVoxel) << place;
    EXPECT_NEAR(contact.penetration, 0, 0.05F * kVoxel) << place;
    EXPECT_GT(contact.inward_normal.z, 0.9999F) << place;
  }
  Contact corner = contact_at({kRadius, kRadius, 0});
  EXPECT_EQ(on.slide(corner), Slide::stayed);
}

}  // namespace
}  // namespace vps::test

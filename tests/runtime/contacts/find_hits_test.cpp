// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/contacts/find_hits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "runtime/fields/penetration.h"
#include "tests/runtime/contacts/growth.h"
#include "tests/runtime/pair.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

// Fields of every kind of kernel.
struct Fields : Pair {
  VoxelmapView real, layers;
  BoxField box{{0.1F, 0.08F, 0.06F}};
  BoxField floor{{2, 0.04F, 3}};  // only two of its faces are near
  HalfSpaceField plane{{0.6F, 0, 0.8F}, 0.02F};
  RevolvedField cylinder{RevolvedField::Profile::cylinder, 0.08F, 0.05F, 0};
  Fields() {
    EXPECT_EQ(map_asset->voxelmap(real, Field::real), Status::ok);
    EXPECT_EQ(map_asset->voxelmap(layers, Field::layers), Status::ok);
  }
  std::vector<FieldRef> all() const { return {map, real, layers, box, floor, plane, cylinder}; }
};

TEST(FindHits, GivesTheContactsOfTraverseWithAndWithoutACache) {
  Fields s;
  std::size_t seen = 0;
  int apart = 0;
  int tight = 0;
  for (const FieldRef field : s.all()) {
    ContactCache cache;
    Random random(7);
    Pose pose;
    for (int i = 0; i < 30; ++i) {
      // Every third pose is far from the last; the others are reached by small steps.
      if (i % 3 == 0) pose = random_pose(random, 0.12);
      pose.translation[i % 2] += 1e-4;
      QueryOptions options;
      options.contact_distance = 0.002F;
      QueryResult result;
      ASSERT_EQ(traverse(s.shell, field, pose, options, s.scratch, s.contacts, result), Status::ok);
      const std::vector<Contact> contacts(s.contacts.begin(), s.contacts.begin() + result.contacts);
      QueryOptions farther;
      farther.contact_distance = 0.3F;
      ASSERT_EQ(traverse(s.shell, field, pose, farther, s.scratch, s.contacts, result), Status::ok);
      float deepest = -farther.contact_distance;
      for (std::uint32_t k = 0; k < result.contacts; ++k) deepest = std::max(deepest, s.contacts[k].penetration);
      for (ContactCache* const memory : {static_cast<ContactCache*>(nullptr), &cache}) {
        options.cache = memory;
        detail::ContactRows hits;
        Scratch scratch;
        float most = 0;
        ASSERT_EQ(detail::find_hits(s.shell, field, pose, options, scratch, hits, most), Status::ok);
        EXPECT_GE(most, deepest - 1e-5F) << i;
        tight += most < deepest + 0.01F;
        apart += hits.count == 0;
        ASSERT_EQ(hits.count, contacts.size()) << i;
        seen += hits.count;
        for (std::uint32_t k = 0; k < hits.count; ++k) {
          const Contact& contact = contacts[k];
          ASSERT_EQ(hits.feature[k], contact.point);
          EXPECT_EQ(hits.penetration[k], contact.penetration);
          const Vec3 off{hits.position[0][k] - contact.position.x, hits.position[1][k] - contact.position.y,
                         hits.position[2][k] - contact.position.z};
          EXPECT_LT(std::hypot(off.x, off.y, off.z), 1e-6);
        }
      }
    }
  }
  EXPECT_GT(seen, 5000U);
  EXPECT_GT(apart, 30);
  EXPECT_GT(tight, 100);
}

TEST(FindHits, OfAFewPointsAreThoseAmongAll) {
  Fields s;
  std::size_t seen = 0;
  for (const FieldRef field : s.all()) {
    Random random(11);
    for (int i = 0; i < 30; ++i) {
      const Pose pose = random_pose(random, 0.12);
      QueryOptions options;
      options.contact_distance = 0.002F;
      detail::ContactRows all;
      Scratch scratch;
      float unused = 0;
      ASSERT_EQ(detail::find_hits(s.shell, field, pose, options, scratch, all, unused), Status::ok);
      // A third of the hits, and some points that are none.
      std::vector<std::uint32_t> points;
      std::map<std::uint32_t, float> expected;
      for (std::uint32_t k = 0; k < all.count && points.size() < 8; k += 3) {
        points.push_back(all.feature[k]);
        expected[all.feature[k]] = all.penetration[k];
      }
      const std::set<std::uint32_t> hits(all.feature, all.feature + all.count);
      for (const std::uint32_t point : {0U, s.shell.points / 2, s.shell.points - 1}) {
        if (!hits.contains(point)) points.push_back(point);
      }
      std::sort(points.begin(), points.end());
      detail::ContactRows few;
      Scratch other;
      ASSERT_EQ(detail::find_hits_of(points, s.shell, field, pose, options, other, few), Status::ok);
      if (field.voxelmap() != nullptr && field.voxelmap()->field != Field::scaled) {
        EXPECT_EQ(few.count, all.count);  // it takes no lists
        continue;
      }
      ASSERT_EQ(few.count, expected.size()) << i;
      seen += few.count;
      for (std::uint32_t k = 0; k < few.count; ++k) EXPECT_EQ(few.penetration[k], expected.at(few.feature[k]));
    }
  }
  EXPECT_GT(seen, 200U);
}

TEST(TraverseAhead, FindsPointsAsDeepAsTheBoxSaysWhereTwoFacesStandForIt) {
  Fields s;
  Random random(5);
  int with_faces = 0;
  constexpr int kBoxes = 400;
  for (int i = 0; i < kBoxes; ++i) {
    const auto half = [&] { return static_cast<float>(0.02 * std::pow(30, random.between(0, 1))); };
    const BoxField box{{half(), half(), half()}};
    Pose pose = random_pose(random, 0);
    const float size[3] = {box.half_extents.x, box.half_extents.y, box.half_extents.z};
    for (int axis = 0; axis < 3; ++axis) pose.translation[axis] = random.between(-1, 1) * (double{size[axis]} + 0.1);
    with_faces += detail::faces_near(box, s.shell, pose).has_value();
    QueryOptions options;
    options.contact_distance = 1;
    QueryResult result;
    ASSERT_EQ(detail::traverse_ahead(s.shell, box, pose, options, {}, s.scratch, s.contacts, result), Status::ok);
    ASSERT_EQ(result.contacts, s.shell.points);
    for (const Contact& contact : s.contacts) {
      ASSERT_NEAR(contact.penetration, penetration(box, contact.position), 1e-6) << i;
    }
  }
  EXPECT_GT(with_faces, kBoxes / 8);
  EXPECT_LT(with_faces, kBoxes / 2);
}

TEST(TraverseAhead, FindsThePointsThatComeNearByTheirOwnWayAndTheDeepestOfEachSegment) {
  Fields s;
  std::size_t seen = 0;
  std::size_t left_out = 0;
  for (const FieldRef field :
       {FieldRef(s.map), FieldRef(s.box), FieldRef(s.floor), FieldRef(s.plane), FieldRef(s.cylinder)}) {
    Random random(8);
    for (int i = 0; i < 20; ++i) {
      const Pose pose = random_pose(random, 0.11);
      const auto any = [&](double most) { return static_cast<float>(random.between(-most, most)); };
      // Long ones are many covering radii. Of a body that turns, points that are nearer than others may go less far.
      const double way = i % 3 == 0 ? 0.003 : i % 3 == 1 ? 0.1 : 0;
      const double turn = i % 3 == 2 ? 0.7 : 0.03;
      const detail::RelativeMotion motion{{any(way), any(way), any(way)}, {any(turn), any(turn), any(turn)}};
      QueryOptions options;
      options.contact_distance = 0.25F;  // more than any way and the near distance
      QueryResult result;
      ASSERT_EQ(traverse(s.shell, field, pose, options, s.scratch, s.contacts, result), Status::ok);
      constexpr float kNear = 0.0005F;
      constexpr double kRounding = 1e-6;
      std::map<std::uint32_t, Contact> wanted;
      std::map<std::uint32_t, double> over;  // by how much a point comes nearer than it must
      for (const Contact& contact : std::span(s.contacts).first(result.contacts)) {
        const Vec3 moved = detail::way_at(motion, contact.position);
        over[contact.point] =
            double{contact.penetration} + double{kNear} + growth(field, s.shell, pose, contact.position, moved);
        if (over[contact.point] >= 0) wanted[contact.point] = contact;
      }
      left_out += result.contacts - wanted.size();

      options.contact_distance = kNear;
      ASSERT_EQ(detail::traverse_ahead(s.shell, field, pose, options, motion, s.scratch, s.contacts, result),
                Status::ok);
      std::map<std::uint32_t, float> found;
      for (const Contact& contact : std::span(s.contacts).first(result.contacts)) {
        found[contact.point] = contact.penetration;
        EXPECT_GE(over[contact.point], -kRounding);
      }
      for (const auto& [point, contact] : wanted) {
        EXPECT_TRUE(found.contains(point) || over[point] < kRounding) << point;
      }
      seen += wanted.size();

      options.segment_level = 1 + static_cast<std::uint32_t>(i / 3 % 3);
      ASSERT_EQ(detail::traverse_ahead(s.shell, field, pose, options, motion, s.scratch, s.contacts, result),
                Status::ok);
      std::map<std::uint32_t, float> deepest;
      for (const Contact& contact : std::span(s.contacts).first(result.contacts)) {
        EXPECT_TRUE(deepest.emplace(contact.node, contact.penetration).second);
      }
      // Points below the nodes of a level follow each other.
      for (const auto& [node, penetration] : deepest) {
        std::uint32_t first = node;
        std::uint32_t last = node;
        for (std::uint32_t level = options.segment_level; level <= s.shell.levels; ++level) {
          first = children_of(s.shell, first).begin;
          last = children_of(s.shell, last).end - 1;
        }
        float most = -1;
        for (auto at = found.lower_bound(first); at != found.end() && at->first <= last; ++at) {
          most = std::max(most, at->second);
        }
        EXPECT_EQ(penetration, most);
        found.erase(found.lower_bound(first), found.upper_bound(last));
      }
      EXPECT_TRUE(found.empty());
    }
  }
  EXPECT_GT(seen, 2000U);
  EXPECT_GT(left_out, 2000U);
}

}  // namespace
}  // namespace vps::test

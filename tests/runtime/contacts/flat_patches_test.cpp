// SPDX-License-Identifier: GPL-3.0-or-later
// Four contacts give the force of a flat patch: beside the sums over all points.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "runtime/fields/penetration.h"
#include "runtime/vps_contacts.h"
#include "tests/runtime/contacts/flat_grounds.h"

namespace vps::test {
namespace {

double length_of(const double (&v)[3]) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}
double difference(const double (&a)[3], const double (&b)[3]) {
  const double apart[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return length_of(apart);
}

TEST(FlatPatches, TheirForceAndTorqueAreThoseOfAllPoints) {
  const Grounds grounds;
  Queries q(*body());
  std::vector<FlatPatch> patches;
  ASSERT_EQ(find_flat_patches(q.shell, patches), Status::ok);
  ASSERT_FALSE(patches.empty());
  const double f = kHullTolerance * double{q.shell.covering_radius};
  constexpr double kArm = 0.04;  // of the body
  Random random;
  std::map<std::string, std::pair<std::size_t, std::size_t>> found;  // contacts with patches, and of all points
  for (const auto& ground : grounds.all()) {
    for (int n = 0; n < 150; ++n) {
      const Pose pose = n % 10 == 9 ? random_pose(random, 0.05)
                                    : flat_pose(random, ground.top, random.between(-0.0004, 0.002), any_tilt(random));
      QueryOptions options;
      options.contact_distance = kTouching;
      QueryResult full;
      ASSERT_EQ(traverse(q.shell, ground.field, pose, options, q.scratch, q.contacts, full), Status::ok);
      const std::vector<Contact> all(q.contacts.begin(), q.contacts.begin() + full.contacts);
      options.flat_patches = patches;
      QueryResult few;
      ASSERT_EQ(traverse(q.shell, ground.field, pose, options, q.scratch, q.contacts, few), Status::ok);
      found[ground.name].first += few.contacts;
      found[ground.name].second += full.contacts;
      double area = 0;
      double sum = 0;
      for (const Contact& c : all) {
        if (c.penetration < 0) continue;
        area += double{c.area};
        sum += double{c.area} * double{c.penetration};
      }
      // What docs/internals/bounds.md states.
      const double most = 5 * f * area + double{kPatchNormal} * sum + 1e-6 * sum;
      const double off = difference(few.force, full.force);
      ASSERT_LE(off, most) << ground.name << n;
      ASSERT_LE(difference(few.torque, full.torque), kArm * (6 * f * area + double{kPatchNormal} * sum + 1e-6 * sum))
          << ground.name << n;
      ASSERT_GE(few.delta_bound, full.delta - 1e-4 * kBodyVoxel) << ground.name << n;
      // Much less is usual.
      ASSERT_LE(off, 1e-4 * sum) << ground.name << n;
      // The contacts have the same sums, also of a damper at every point.
      Wrench of_few;
      Wrench of_all;
      const PenaltyLaw law{1e6, 1e3};
      const Twist twist{{0, 0, 0.05F}, {0.01F, 0.02F, -0.1F}, {0.3F, -0.2F, 0.4F}};
      ASSERT_EQ(penalty_wrench(std::span(q.contacts).first(few.contacts), law, twist, of_few), Status::ok);
      ASSERT_EQ(penalty_wrench(all, law, twist, of_all), Status::ok);
      double pressed = 0;
      for (const Contact& c : all) pressed += double{c.area} * law.damping * 0.2;
      ASSERT_LE(difference(of_few.force, of_all.force), law.stiffness * most + 0.01 * pressed) << ground.name << n;
    }
  }
  for (const char* const flat : {"plane", "box", "coarse"}) {
    EXPECT_LT(3 * found[flat].first, found[flat].second) << flat;
  }
}

// With two children a node flat nodes of many levels are searched at once.
TEST(FlatPatches, NodesOfAllLevelsAreSearched) {
  bake::BakeOptions options;
  options.resolution = 60;
  options.field_error = 0.01;
  options.branching = 2;
  const auto bolt = baked(samples::make_bolt(), options);
  Queries q(*bolt);
  VoxelmapView map;
  ASSERT_EQ(bolt->voxelmap(map), Status::ok);
  std::vector<FlatPatch> patches;
  ASSERT_EQ(find_flat_patches(q.shell, patches), Status::ok);
  Random random;
  for (int n = 0; n < 100; ++n) {
    const double reach = bolt->info().bounds_max[0];
    Pose pose = random_pose(random, reach);
    if (n % 2 == 0) std::copy_n(Pose().rotation, 9, pose.rotation);
    QueryOptions query;
    QueryResult all;
    QueryResult few;
    ASSERT_EQ(traverse(q.shell, map, pose, query, q.scratch, q.contacts, all), Status::ok);
    query.flat_patches = patches;
    ASSERT_EQ(traverse(q.shell, map, pose, query, q.scratch, q.contacts, few), Status::ok);
    ASSERT_LE(difference(few.force, all.force), 0.02 * length_of(all.force)) << n;
    if (all.delta < 0) continue;
    ASSERT_GE(few.delta, all.delta - 0.02 * bolt->info().voxel_size) << n;
  }
}

// Points below flat nodes are found last, out of order, and so are their facets.
TEST(FlatPatches, FacetsStillCount) {
  const Grounds grounds;
  for (const std::shared_ptr<Asset>& asset : {body(), baked(make_torus(0.1, 0.05, 8, 6), coarse_options())}) {
    Queries q(*asset);
    ASSERT_GT(q.shell.facets, 0U);
    std::vector<FlatPatch> patches;
    ASSERT_EQ(find_flat_patches(q.shell, patches), Status::ok);
    Random random;
    for (const auto& ground : grounds.all()) {
      for (int n = 0; n < 60; ++n) {
        QueryOptions options;
        options.weight = Weight::per_patch;
        const Pose pose = n % 2 == 0 ? random_pose(random, 0.08)
                                     : flat_pose(random, ground.top, random.between(-0.001, 0.001), any_tilt(random));
        QueryResult full;
        std::vector<Contact> out(4 * q.contacts.size());
        ASSERT_EQ(traverse(q.shell, ground.field, pose, options, q.scratch, out, full), Status::ok);
        double area = 0;
        double sum = 0;
        for (std::uint32_t i = 0; i < full.contacts; ++i) {
          area += double{out[i].area};
          sum += double{out[i].area} * double{out[i].penetration};
        }
        options.flat_patches = patches;
        QueryResult few;
        ASSERT_EQ(traverse(q.shell, ground.field, pose, options, q.scratch, out, few), Status::ok);
        // What docs/internals/bounds.md states.
        const double f = kHullTolerance * double{q.shell.covering_radius};
        ASSERT_LE(difference(few.force, full.force), 5 * f * area + double{kPatchNormal} * sum) << ground.name << n;
      }
    }
  }
}

TEST(FlatPatches, ACacheChangesNothing) {
  const Grounds grounds;
  Queries with(*body());
  Queries without(*body());
  std::vector<FlatPatch> patches;
  ASSERT_EQ(find_flat_patches(with.shell, patches), Status::ok);
  Random random;
  std::size_t kept = 0;
  for (const auto& ground : grounds.all()) {
    ContactCache cache;
    Pose pose = flat_pose(random, ground.top, 0.0002, any_tilt(random));
    for (int step = 0; step < 60; ++step) {
      for (double& x : pose.translation) x += random.between(-1e-6, 1e-6);
      QueryOptions options;
      options.contact_distance = kTouching;
      options.flat_patches = patches;
      QueryResult a;
      QueryResult b;
      ASSERT_EQ(traverse(without.shell, ground.field, pose, options, without.scratch, without.contacts, a), Status::ok);
      options.cache = &cache;
      ASSERT_EQ(traverse(with.shell, ground.field, pose, options, with.scratch, with.contacts, b), Status::ok);
      ASSERT_EQ(a.contacts, b.contacts) << ground.name << step;
      ASSERT_EQ(std::memcmp(a.force, b.force, sizeof a.force), 0) << ground.name << step;
      ASSERT_EQ(std::memcmp(a.torque, b.torque, sizeof a.torque), 0) << ground.name << step;
      kept += cache.flats.size();
    }
  }
  EXPECT_GT(kept, 100U);
}

}  // namespace
}  // namespace vps::test

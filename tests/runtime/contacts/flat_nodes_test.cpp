// SPDX-License-Identifier: GPL-3.0-or-later
// Flat nodes answer for their points: beside the regular traverse, which tests every point.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <span>
#include <vector>

#include "runtime/contacts/find_hits.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/fields/penetration.h"
#include "runtime/vps_contacts.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kBodyVoxel = 0.001;
constexpr float kTouching = 0.0003F;

std::shared_ptr<Asset> body() {
  bake::BakeOptions options;
  options.voxel_size = kBodyVoxel;
  return baked(make_box({0.06, 0.05, 0.008}), options);
}

bake::BakeOptions coarse_options() {
  bake::BakeOptions options;
  options.voxel_size = 2 * kBodyVoxel;
  return options;
}

// Ground of every kind that a face may lie on. Its top is z = 0 near the origin.
struct Grounds {
  HalfSpaceField plane{{0, 0, 1}, 0};
  BoxField box{{0.2F, 0.2F, 0.05F}};      // larger than the face
  BoxField ledge{{0.2F, 0.015F, 0.05F}};  // narrower: the face lies across it
  RevolvedField post{RevolvedField::Profile::cylinder, 0.03F, 0.05F, 0};
  SphereField ball{0.05F};
  VoxelmapView coarse, fine, round, boss;
  std::vector<std::shared_ptr<Asset>> assets;

  Grounds() {
    assets = {ground(make_box({0.12, 0.12, 0.02}), 0.004), ground(make_box({0.09, 0.08, 0.02}), kBodyVoxel),
              ground(make_torus(0.06, 0.03, 60, 30), 0.002), ground(with_boss(), kBodyVoxel)};
    for (const auto& [view, asset] :
         {std::pair{&coarse, &assets[0]}, {&fine, &assets[1]}, {&round, &assets[2]}, {&boss, &assets[3]}}) {
      EXPECT_EQ((*asset)->voxelmap(*view), Status::ok);
    }
  }
  // A disc whose flat top has a small boss in the middle.
  static TriangleMesh with_boss() {
    const auto circle = [](double radius) { return [=](double) { return radius; }; };
    return samples::make_skin(
        {samples::make_ring(60, -0.02, circle(0.09)), samples::make_ring(60, 0.02, circle(0.09)),
         samples::make_ring(60, 0.02, circle(0.004)), samples::make_ring(60, 0.0206, circle(0.003))},
        false);
  }
  static std::shared_ptr<Asset> ground(const TriangleMesh& mesh, double voxel_size) {
    bake::BakeOptions options;
    options.voxel_size = voxel_size;
    options.pointshell = false;
    return baked(mesh, options);
  }
  struct Ground {
    const char* name;
    FieldRef field;
    double top;  // z of its surface in its own frame. [m]
  };
  [[nodiscard]] std::vector<Ground> all() const {
    return {{"plane", plane, 0},  {"box", box, 0.05},     {"ledge", ledge, 0.05},
            {"post", post, 0.05}, {"ball", ball, 0.05},   {"coarse", coarse, 0.02},
            {"fine", fine, 0.02}, {"round", round, 0.03}, {"boss", boss, 0.02}};
  }
};

// The body's lower face `depth` deep in the ground, turned about z and tilted.
Pose flat_pose(Random& random, double top, double depth, double tilt) {
  const double c = std::cos(random.between(0, 6.3));
  const double s = std::sqrt(1 - c * c);
  const double axis = random.between(0, 6.3);
  const double tx = tilt * std::cos(axis);
  const double ty = tilt * std::sin(axis);
  Pose pose = pose_at(random.between(-0.01, 0.01), random.between(-0.01, 0.01), top + 0.008 - depth);
  // R = Rx(tx) Ry(ty) Rz
  const double cx = std::cos(tx), sx = std::sin(tx), cy = std::cos(ty), sy = std::sin(ty);
  const double rz[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
  const double ry[9] = {cy, 0, sy, 0, 1, 0, -sy, 0, cy};
  const double rx[9] = {1, 0, 0, 0, cx, -sx, 0, sx, cx};
  const auto times = [](const double(&a)[9], const double(&b)[9], double(&out)[9]) {
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        out[3 * i + k] = 0;
        for (int j = 0; j < 3; ++j) out[3 * i + k] += a[3 * i + j] * b[3 * j + k];
      }
    }
  };
  double tilted[9];
  times(rx, ry, tilted);
  times(tilted, rz, pose.rotation);
  return pose;
}

double any_tilt(Random& random) {
  constexpr double kTilts[] = {0, 1e-5, 1e-4, 1e-3, 1e-2, 0.1};
  return kTilts[static_cast<std::size_t>(random.between(0, 5.999))];
}

float support(std::span<const Vec3> places, Vec3 along) {
  float most = -1e9F;
  for (const Vec3& p : places) most = std::max(most, detail::dot(p, along));
  return most;
}

class Queries {
 public:
  explicit Queries(const Asset& asset) {
    EXPECT_EQ(asset.pointshell(shell), Status::ok);
    contacts.resize(shell.points);
    // What docs/internals/bounds.md states for depths, and for places.
    bent = 4 * static_cast<float>(kHullTolerance) * shell.covering_radius;
    off = bent / 2 + 3 * shell.position_step;
  }
  // Every point in contact.
  std::span<const Contact> all(FieldRef field, const Pose& pose, float distance) {
    QueryOptions options;
    options.contact_distance = distance;
    QueryResult result;
    EXPECT_EQ(traverse(shell, field, pose, options, scratch, contacts, result), Status::ok);
    return std::span(contacts).first(result.contacts);
  }
  detail::ContactRows hits(FieldRef field, const Pose& pose, ContactCache* cache) {
    QueryOptions options;
    options.contact_distance = kTouching;
    options.cache = cache;
    detail::ContactRows rows;
    EXPECT_EQ(detail::find_hits(shell, field, pose, options, hit_scratch, rows, most), Status::ok);
    return rows;
  }

  PointshellView shell;
  float bent = 0, off = 0, most = 0;
  Scratch scratch, hit_scratch;
  std::vector<Contact> contacts;
};

Vec3 place_of(const detail::ContactRows& rows, std::uint32_t i) {
  return {rows.position[0][i], rows.position[1][i], rows.position[2][i]};
}

TEST(FlatNodes, TheirCornersHaveTheDepthAndTheExtentOfAllPointsInContact) {
  const Grounds grounds;
  Queries q(*body());
  ASSERT_NE(q.shell.hull_offsets, nullptr);
  Random random;
  std::map<std::string, std::pair<std::size_t, std::size_t>> found;  // hits, contacts
  for (const auto& ground : grounds.all()) {
    for (int n = 0; n < 150; ++n) {
      const Pose pose = n % 10 == 9 ? random_pose(random, 0.05)
                                    : flat_pose(random, ground.top, random.between(-0.0004, 0.002), any_tilt(random));
      const std::span<const Contact> all = q.all(ground.field, pose, kTouching);
      const detail::ContactRows rows = q.hits(ground.field, pose, nullptr);
      found[ground.name].first += rows.count;
      found[ground.name].second += all.size();
      ASSERT_EQ(rows.count == 0, all.empty()) << ground.name << n;
      if (all.empty()) continue;
      std::map<std::uint32_t, float> by_point;
      std::vector<Vec3> everywhere;
      std::vector<Vec3> places;
      float deepest = -1;
      for (const Contact& c : all) {
        by_point[c.point] = c.penetration;
        everywhere.push_back(c.position);
        deepest = std::max(deepest, c.penetration);
      }
      float deepest_hit = -1;
      for (std::uint32_t i = 0; i < rows.count; ++i) {
        ASSERT_TRUE(by_point.contains(rows.feature[i])) << ground.name << n;
        ASSERT_NEAR(rows.penetration[i], by_point[rows.feature[i]], 1e-4 * kBodyVoxel);
        deepest_hit = std::max(deepest_hit, rows.penetration[i]);
        places.push_back(place_of(rows, i));
      }
      ASSERT_GE(deepest_hit, deepest - q.bent) << ground.name << n;
      ASSERT_GE(q.most, deepest - 1e-4 * kBodyVoxel) << ground.name << n;
      for (int k = 0; k < 30; ++k) {
        const double angle = k * 0.21;
        const Vec3 along = {static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0};
        ASSERT_GE(support(places, along), support(everywhere, along) - q.off) << ground.name << n;
      }
    }
  }
  // A face costs its corners; on a curved ground all points that touch are found.
  for (const char* const flat : {"plane", "box", "coarse"}) {
    EXPECT_LT(10 * found[flat].first, 9 * found[flat].second) << flat;
  }
  EXPECT_LT(found["fine"].first, found["fine"].second);
  for (const auto& [name, counts] : found) EXPECT_GT(counts.first, 500U) << name;
}

// The deepest hits of the segments of a moving body, from all points.
std::map<std::uint32_t, float> deepest_of_segments(const Queries& q, FieldRef field, const Pose& pose,
                                                   const detail::RelativeMotion& motion, std::uint32_t level,
                                                   float distance) {
  using detail::operator+;
  const detail::Transform to_field(pose);
  std::map<std::uint32_t, float> deepest;
  for (std::uint32_t node = q.shell.level_offsets[level - 1]; node < q.shell.level_offsets[level]; ++node) {
    const IndexRange below = detail::points_below(q.shell, node);
    for (std::uint32_t point = below.begin; point < below.end; ++point) {
      const Vec3 p = to_field.apply(point_position(q.shell, point));
      const float way = detail::length(motion.shift + detail::cross(motion.turn, p));
      const float v = penetration(field, p, to_field.rotate(point_inward_normal(q.shell, point)));
      if (!(v >= -(distance + way))) continue;
      const auto [at, is_new] = deepest.try_emplace(node, v);
      at->second = std::max(at->second, v);
    }
  }
  return deepest;
}

TEST(FlatNodes, TheDeepestCornerAnswersForItsSegment) {
  const Grounds grounds;
  Queries q(*body());
  Random random;
  PointshellView without = q.shell;
  without.hull_offsets = nullptr;
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> tested;  // points, with flat nodes and without
  for (const auto& ground : grounds.all()) {
    for (int n = 0; n < 100; ++n) {
      const Pose pose = n % 10 == 9 ? random_pose(random, 0.05)
                                    : flat_pose(random, ground.top, random.between(-0.004, 0.002), any_tilt(random));
      const auto part = [&](double most) { return static_cast<float>(random.between(-most, most)); };
      const detail::RelativeMotion motion{{part(0.001), part(0.001), n % 3 == 0 ? 0 : -0.003F + part(0.003)},
                                          {part(0.05), part(0.05), part(0.05)}};
      QueryOptions options;
      options.contact_distance = kTouching;
      options.segment_level = std::min(2U + static_cast<std::uint32_t>(n) % 3, q.shell.levels - 1);
      const auto ahead = [&](const PointshellView& shell) {
        QueryResult result;
        EXPECT_EQ(detail::traverse_ahead(shell, ground.field, pose, options, motion, q.scratch, q.contacts, result),
                  Status::ok);
        return result;
      };
      tested[ground.name].second += ahead(without).points_tested;
      const QueryResult result = ahead(q.shell);
      tested[ground.name].first += result.points_tested;
      std::map<std::uint32_t, float> found;
      for (std::uint32_t i = 0; i < result.contacts; ++i) {
        EXPECT_TRUE(i == 0 || q.contacts[i - 1].node < q.contacts[i].node);
        found[q.contacts[i].node] = q.contacts[i].penetration;
      }
      // Where a hit begins, rounding decides.
      const float rounding = q.bent + 1e-5F;
      const auto least =
          deepest_of_segments(q, ground.field, pose, motion, options.segment_level, kTouching - rounding);
      const auto most = deepest_of_segments(q, ground.field, pose, motion, options.segment_level, kTouching + rounding);
      for (const auto& [node, v] : least) {
        ASSERT_TRUE(found.contains(node)) << ground.name << n;
        ASSERT_GE(found[node], v - q.bent) << ground.name << n;
      }
      for (const auto& [node, v] : found) {
        ASSERT_TRUE(most.contains(node)) << ground.name << n;
        ASSERT_LE(v, most.at(node) + 1e-5F * static_cast<float>(kBodyVoxel) + 1e-7F) << ground.name << n;
      }
    }
  }
  for (const char* const flat : {"plane", "box"}) EXPECT_LT(3 * tested[flat].first, tested[flat].second) << flat;
}

bool same_rows(const detail::ContactRows& a, const detail::ContactRows& b) {
  if (a.count != b.count) return false;
  const auto same = [&](const void* x, const void* y) { return std::memcmp(x, y, 4 * std::size_t{a.count}) == 0; };
  return same(a.feature, b.feature) && same(a.penetration, b.penetration) && same(a.position[0], b.position[0]) &&
         same(a.position[1], b.position[1]) && same(a.position[2], b.position[2]);
}

TEST(FlatNodes, ACacheChangesNothingWhileAFaceSlidesTipsAndLeaves) {
  const Grounds grounds;
  Queries with(*body());
  Queries without(*body());
  Random random;
  std::size_t kept = 0;
  for (const auto& ground : grounds.all()) {
    ContactCache cache;
    for (int run = 0; run < 6; ++run) {
      Pose pose = flat_pose(random, ground.top, 0.0002, any_tilt(random));
      const double speed = std::pow(10, random.between(-7, -4));  // [m a step]
      for (int step = 0; step < 60; ++step) {
        for (double& x : pose.translation) x += random.between(-speed, speed);
        pose.translation[0] += speed;
        const detail::ContactRows a = with.hits(ground.field, pose, &cache);
        const detail::ContactRows b = without.hits(ground.field, pose, nullptr);
        ASSERT_TRUE(same_rows(a, b)) << ground.name << " " << run << " " << step;
        kept += cache.flats.size();
      }
    }
  }
  EXPECT_GT(kept, 1000U);
}

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

// The body's upper face lies within the sphere of its node, and beyond the box around the ground.
TEST(FlatNodes, OnBakedGroundTheFaceAboveIsNotOpened) {
  const Grounds grounds;
  Queries q(*body());
  std::vector<FlatPatch> patches;
  ASSERT_EQ(find_flat_patches(q.shell, patches), Status::ok);
  Random random;
  for (int n = 0; n < 20; ++n) {
    const double depth = random.between(0.0001, 0.0004);
    QueryOptions options;
    options.contact_distance = kTouching;
    options.flat_patches = patches;
    const auto tested = [&](FieldRef field, double top) {
      QueryResult result;
      Random same;
      EXPECT_EQ(traverse(q.shell, field, flat_pose(same, top, depth, 0), options, q.scratch, q.contacts, result),
                Status::ok);
      return result.nodes_tested;
    };
    EXPECT_LT(tested(grounds.coarse, 0.02), 1.2 * tested(grounds.plane, 0)) << n;
  }
}

TEST(FlatNodes, EveryInstructionSetFindsTheSameCorners) {
  const Grounds grounds;
  Queries q(*body());
  for (const auto& ground : grounds.all()) {
    Random random;
    for (int n = 0; n < 20; ++n) {
      const Pose pose = flat_pose(random, ground.top, 0.0004, n % 2 == 0 ? 0 : 0.01);
      std::vector<std::set<std::uint32_t>> answers;
      for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
        hwy::SetSupportedTargetsForTest(left & -left);
        const detail::ContactRows rows = q.hits(ground.field, pose, nullptr);
        answers.emplace_back(rows.feature, rows.feature + rows.count);
        hwy::SetSupportedTargetsForTest(0);
      }
      for (const std::set<std::uint32_t>& answer : answers) {
        // Points within a rounding of the contact distance may differ, and nodes within one of acceptance.
        EXPECT_LE(answer.size(), 3 * answers[0].size() + 8) << ground.name << n;
        EXPECT_GE(3 * answer.size() + 8, answers[0].size()) << ground.name << n;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

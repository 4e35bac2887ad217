// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

#include "runtime/fields/penetration.h"
#include "runtime/vps_contacts.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kVoxelSize = 0.001;

// A baked body and its views.
struct BakedBody {
  std::shared_ptr<Asset> asset;
  PointshellView shell;
  VoxelmapView map;
  explicit BakedBody(const TriangleMesh& mesh, double thin_faces = 1, double voxel = kVoxelSize,
                     double alpha = bake::BakeOptions().alpha) {
    bake::BakeOptions options;
    options.voxel_size = voxel;
    options.alpha = alpha;
    options.thin_faces = thin_faces;
    asset = baked(mesh, options);
    EXPECT_EQ(asset->pointshell(shell), Status::ok);
    EXPECT_EQ(asset->voxelmap(map), Status::ok);
  }
  [[nodiscard]] StepBody at(double x, double y, double z) const { return {map, pose_at(x, y, z), &shell}; }
};

struct Step {
  StepScratch scratch;
  std::vector<StepContact> contacts;
  Status find(const StepBody& first, const StepBody& second, const StepOptions& options = {}, std::size_t most = 4) {
    contacts.resize(most);
    std::span<StepContact> found = contacts;
    const Status status = step_contacts(first, second, options, scratch, found);
    contacts.resize(found.size());
    return status;
  }
};

const BakedBody& cube() {
  static const BakedBody body(make_box({0.02, 0.02, 0.02}));
  return body;
}
const BakedBody& ball() {
  static const BakedBody body(make_sphere(0.02, 5));
  return body;
}
const BakedBody& torus() {
  static const BakedBody body(make_torus(0.03, 0.01, 64, 32));
  return body;
}

TEST(StepContacts, ACubeOnAPlaneHasFourThatSpanItMidwayBetweenTheSurfaces) {
  const HalfSpaceField plane;
  Step step;
  ASSERT_EQ(step.find(cube().at(0, 0, 0.0198), {plane, Pose()}), Status::ok);
  ASSERT_EQ(step.contacts.size(), 4U);
  double least[2] = {};
  double most[2] = {};
  for (const StepContact& contact : step.contacts) {
    EXPECT_NEAR(contact.penetration, 0.0002, 1e-5);
    EXPECT_NEAR(contact.position[2], -0.0001, 1e-5);
    EXPECT_GT(contact.normal.z, 0.999F);  // into the first
    for (int k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], contact.position[k]);
      most[k] = std::max(most[k], contact.position[k]);
    }
  }
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(least[k], -0.02, kVoxelSize);
    EXPECT_NEAR(most[k], 0.02, kVoxelSize);
  }
}

// Of two equal bodies the first gives its points, and there is none near the corner.
TEST(StepContacts, ACornerMeetsAFaceBetweenItsPoints) {
  const double half = 0.02 * std::sqrt(3.0);
  for (const double depth : {0.0003, 0.002}) {
    for (const double aside : {0.0, 0.0004, 0.0009}) {
      StepBody above = cube().at(aside, 0.0002, 0.02 + half - depth);
      // Its diagonal upright: rows are the world's axes.
      const double a = 1 / std::sqrt(6.0);
      const double b = 1 / std::sqrt(2.0);
      const double c = 1 / std::sqrt(3.0);
      const double rotation[9] = {a, a, -2 * a, b, -b, 0, -c, -c, -c};
      std::copy(std::begin(rotation), std::end(rotation), std::begin(above.pose.rotation));
      ASSERT_EQ(check_pose(above.pose), Status::ok);
      for (const bool is_first : {true, false}) {
        Step step;
        const StepBody below = cube().at(0, 0, 0);
        ASSERT_EQ(is_first ? step.find(above, below) : step.find(below, above), Status::ok);
        ASSERT_FALSE(step.contacts.empty());
        const StepContact& deepest = step.contacts[0];
        EXPECT_NEAR(deepest.penetration, depth, 0.1 * kVoxelSize);
        EXPECT_NEAR(std::abs(deepest.normal.z), 1, 1e-4);
        EXPECT_NEAR(deepest.position[0], aside, 0.1 * kVoxelSize);
      }
    }
  }
}

TEST(StepContacts, ExchangedBodiesHaveTheSameContactsWithOppositeNormals) {
  Step one;
  Step other;
  const StepBody a = torus().at(1000, -2000, 500);
  const StepBody b = ball().at(1000.03, -2000, 500.0295);
  ASSERT_EQ(one.find(a, b), Status::ok);
  ASSERT_EQ(other.find(b, a), Status::ok);
  ASSERT_EQ(one.contacts.size(), other.contacts.size());
  ASSERT_FALSE(one.contacts.empty());
  for (std::size_t i = 0; i < one.contacts.size(); ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(one.contacts[i].position[k], other.contacts[i].position[k]);
    EXPECT_EQ(one.contacts[i].penetration, other.contacts[i].penetration);
    EXPECT_EQ(detail::dot(one.contacts[i].normal, other.contacts[i].normal),
              -detail::dot(one.contacts[i].normal, one.contacts[i].normal));
  }
  EXPECT_NEAR(one.contacts[0].penetration, 0.0005, 1e-4);
  EXPECT_LT(one.contacts[0].normal.z, -0.99F);  // into the torus, which is below
}

TEST(StepContacts, TheBestComeFirst) {
  const HalfSpaceField plane;
  Step many;
  ASSERT_EQ(many.find(cube().at(0, 0, 0.0198), {plane, Pose()}, {0, StepUse::samples}, 30), Status::ok);
  ASSERT_GT(many.contacts.size(), 4U);
  ASSERT_LE(many.contacts.size(), 30U);
  for (const StepContact& contact : many.contacts) EXPECT_GE(many.contacts[0].penetration, contact.penetration);
  // The first four span the face.
  double largest[2] = {0, 0};
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 2; ++k) largest[k] = std::max(largest[k], many.contacts[i].position[k]);
  }
  EXPECT_NEAR(largest[0], 0.02, kVoxelSize);
  EXPECT_NEAR(largest[1], 0.02, kVoxelSize);
}

TEST(StepContacts, ABallTouchesBetweenItsPoints) {
  const HalfSpaceField plane;
  for (const double turn : {0.0, 0.013, 0.026, 0.039}) {
    StepBody body = ball().at(0, 0, 0.0199);
    body.pose.rotation[0] = body.pose.rotation[8] = std::cos(turn);
    body.pose.rotation[2] = std::sin(turn);
    body.pose.rotation[6] = -std::sin(turn);
    Step step;
    ASSERT_EQ(step.find(body, {plane, Pose()}), Status::ok);
    ASSERT_EQ(step.contacts.size(), 1U) << turn;
    EXPECT_NEAR(step.contacts[0].penetration, 0.0001, 3e-5) << turn;
    EXPECT_NEAR(step.contacts[0].position[0], 0, 3e-4) << turn;
  }
}

// In most rotations all points are outside.
TEST(StepContacts, ABallOfCoarsePointsTouchesAsSoonAsItsSurfaceDoes) {
  constexpr double kDepth = 0.0001;
  const HalfSpaceField plane;
  for (const double alpha : {1.5, 3.0, 4.0}) {
    const BakedBody coarse(make_sphere(0.02, 5), 1, kVoxelSize, alpha);
    Random random;
    for (int n = 0; n < 40; ++n) {
      StepBody body = coarse.at(0, 0, 0);
      body.pose = random_pose(random, 0);
      body.pose.translation[2] = 0.02 - kDepth;
      Step step;
      ASSERT_EQ(step.find(body, {plane, Pose()}), Status::ok);
      ASSERT_EQ(step.contacts.size(), 1U) << alpha << ", " << n;
      EXPECT_NEAR(step.contacts[0].penetration, kDepth, 5e-5) << alpha << ", " << n;
      EXPECT_NEAR(step.contacts[0].position[0], 0, 6e-4) << alpha << ", " << n;
      EXPECT_NEAR(step.contacts[0].position[1], 0, 6e-4) << alpha << ", " << n;
    }
  }
}

// A rotation that turns a cube's corner down.
Pose on_corner(double x, double y, double z) {
  Pose pose = pose_at(x, y, z);
  const double a = std::sqrt(0.5);
  const double b = std::sqrt(1 / 6.0);
  const double c = -std::sqrt(1 / 3.0);
  const double rows[9] = {a, -a, 0, -b, -b, 2 * b, c, c, c};
  std::copy_n(rows, 9, pose.rotation);
  return pose;
}

TEST(StepContacts, SmallBodiesTouchAFaceBetweenItsPoints) {
  constexpr double kDepth = 0.0001;
  const SphereField sphere{0.0006F};
  const RevolvedField capsule{RevolvedField::Profile::capsule, 0.0006F, 0.006F, 0};
  const BoxField box{{0.005F, 0.005F, 0.005F}};
  for (int i = 0; i < 6; ++i) {
    const double x = 0.0013 + 0.0004 * i;
    const double y = 0.0007 - 0.0003 * i;
    const auto above = [&](double height) { return pose_at(x, y, 0.02 + height - kDepth); };
    Step step;
    for (const StepBody& body : {StepBody{sphere, above(0.0006)}, StepBody{capsule, above(0.0066)},
                                 StepBody{box, on_corner(x, y, 0.02 + 0.005 * std::sqrt(3.0) - kDepth)}}) {
      ASSERT_EQ(step.find(body, cube().at(0, 0, 0)), Status::ok);
      ASSERT_EQ(step.contacts.size(), 1U) << i;
      EXPECT_NEAR(step.contacts[0].penetration, kDepth, 3e-5) << i;
      EXPECT_GT(step.contacts[0].normal.z, 0.99F) << i;
      EXPECT_NEAR(step.contacts[0].position[0], x, 5e-5) << i;
      EXPECT_NEAR(step.contacts[0].position[2], 0.02 - kDepth / 2, 3e-5) << i;
    }
  }
}

TEST(StepContacts, SurfacesWithinTheDistanceAreInContact) {
  const HalfSpaceField plane;
  Step step;
  ASSERT_EQ(step.find(cube().at(0, 0, 0.0203), {plane, Pose()}), Status::ok);
  EXPECT_TRUE(step.contacts.empty());
  ASSERT_EQ(step.find(cube().at(0, 0, 0.0203), {plane, Pose()}, {0.0005F}), Status::ok);
  ASSERT_EQ(step.contacts.size(), 4U);
  EXPECT_NEAR(step.contacts[0].penetration, -0.0003, 1e-5);
}

TEST(StepContacts, SpringsKeepTheForceOfAllPoints) {
  Step step;
  const StepBody body = torus().at(0, 0, 0);
  const StepBody other = ball().at(0.03, 0, 0.029);
  ASSERT_EQ(step.find(body, other, {0, StepUse::springs}, 8), Status::ok);
  ASSERT_FALSE(step.contacts.empty());
  EXPECT_LE(step.contacts.size(), 8U);
  double force = 0;
  for (const StepContact& contact : step.contacts)
    force -= double(contact.penetration * contact.area * contact.normal.z);
  // The volume of the ball's cap in the torus, nearly that of two spheres' lens per unit of depth.
  std::vector<Contact> all(ball().shell.points);
  Scratch scratch;
  QueryResult result;
  ASSERT_EQ(traverse(ball().shell, torus().map, other.pose, {}, scratch, all, result), Status::ok);
  EXPECT_NEAR(force, std::abs(result.force[2]), 0.1 * std::abs(result.force[2]));
}

TEST(StepContacts, AMemoryNoticesThatABodyHasAnotherSize) {
  const StepBody shell = cube().at(0, 0, 0.05);
  BoxField box{{0.05F, 0.05F, 0.01F}};
  SphereField sphere{0.01F};
  HalfSpaceField ground{{0, 0, 1}, 0};
  Step step;
  const auto count = [&](const StepBody& body, FieldRef field, StepMemory* memory) {
    EXPECT_EQ(step.find(body, {field, pose_at(0, 0, 0)}, {.memory = memory}), Status::ok);
    return step.contacts.size();
  };
  StepMemory of_box, of_sphere, of_ground, of_scale;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(count(shell, box, &of_box), 0U);
    EXPECT_EQ(count(shell, sphere, &of_sphere), 0U);
    EXPECT_EQ(count(shell, ground, &of_ground), 0U);
    EXPECT_EQ(count(shell, ground, &of_scale), 0U);
  }
  const auto expect_as_without = [&](const StepBody& body, FieldRef field, StepMemory& memory) {
    const std::size_t without = count(body, field, nullptr);
    EXPECT_GT(without, 0U);
    EXPECT_EQ(count(body, field, &memory), without);
  };
  box.half_extents.z = 0.035F;
  expect_as_without(shell, box, of_box);
  sphere.radius = 0.035F;
  expect_as_without(shell, sphere, of_sphere);
  PointshellView large;
  ASSERT_EQ(cube().asset->pointshell(large, 3), Status::ok);
  expect_as_without({cube().map, shell.pose, &large}, ground, of_scale);
  ground.offset = 0.035F;
  expect_as_without(shell, ground, of_ground);
}

TEST(StepContacts, AMemoryKeepsContactsThatAreNearlyAsGood) {
  const HalfSpaceField plane;
  Step step;
  StepMemory memory;
  std::set<std::uint32_t> with;
  std::set<std::uint32_t> without;
  for (int i = 0; i < 12; ++i) {
    StepBody body = cube().at(0, 0, 0.0199);
    const double tilt = 2e-6 * (i % 3 - 1);
    body.pose.rotation[1] = -tilt;
    body.pose.rotation[2] = body.pose.rotation[3] = tilt;
    body.pose.rotation[6] = -tilt;
    ASSERT_EQ(step.find(body, {plane, Pose()}, {0, StepUse::samples, &memory}), Status::ok);
    for (const StepContact& contact : step.contacts) with.insert(contact.feature);
    ASSERT_EQ(step.find(body, {plane, Pose()}, {0, StepUse::samples}), Status::ok);
    for (const StepContact& contact : step.contacts) without.insert(contact.feature);
  }
  EXPECT_EQ(with.size(), 4U);
  EXPECT_GT(without.size(), 4U);
}

TEST(StepContacts, APairThatStandsStillHasTheContactsOfItsFirstStep) {
  const BakedBody slab(make_box({0.05, 0.05, 0.01}), 1, 0.002);
  StepMemory memory;
  StepOptions options;
  options.memory = &memory;
  Step step;
  const auto by_feature = [](const StepContact& a, const StepContact& b) { return a.feature < b.feature; };
  // Over an edge of the slab, where directions of the map and of the shell differ.
  const auto find = [&](double z) {
    ASSERT_EQ(step.find(cube().at(0.045, 0.001, z), slab.at(0, 0, 0), options), Status::ok);
    std::sort(step.contacts.begin(), step.contacts.end(), by_feature);
  };
  find(0.0298);
  const std::vector<StepContact> first = step.contacts;
  ASSERT_EQ(first.size(), 4U);
  for (int i = 1; i < 5; ++i) {
    const double up = i * 2e-7;
    find(0.0298 + up);
    ASSERT_EQ(step.contacts.size(), first.size());
    for (std::size_t k = 0; k < first.size(); ++k) {
      const StepContact& a = first[k];
      const StepContact& b = step.contacts[k];
      EXPECT_EQ(a.feature, b.feature);
      EXPECT_EQ(a.area, b.area);
      EXPECT_NEAR(a.penetration - up, b.penetration, 2e-7);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(a.position[axis], b.position[axis], 1e-6);
      EXPECT_GT(detail::dot(a.normal, b.normal), 1 - 1e-6F);
    }
  }
}

TEST(StepContacts, OfThinnedFacesBothBodiesGiveTheirPoints) {
  // The slab has the finer voxels; a corner of the cube lies between the points of its face.
  const BakedBody slab(make_box({0.05, 0.05, 0.02}), 4, kVoxelSize);
  const BakedBody small(make_box({0.01, 0.01, 0.01}), 4, 1.3 * kVoxelSize);
  const double c = std::sqrt(0.5);
  for (const double x : {0.0, 0.0013, 0.0026}) {
    StepBody body = small.at(x, 0.0007, 0.02 + 0.01 * std::sqrt(2.0) - 0.0003);
    body.pose.rotation[4] = body.pose.rotation[8] = c;  // on an edge
    body.pose.rotation[5] = -c;
    body.pose.rotation[7] = c;
    Step step;
    ASSERT_EQ(step.find(body, slab.at(0, 0, 0)), Status::ok);
    ASSERT_FALSE(step.contacts.empty()) << x;
    EXPECT_NEAR(step.contacts[0].penetration, 0.0003, 3e-4) << x;
    EXPECT_GT(step.contacts[0].normal.z, 0.9F) << x;
  }
}

TEST(StepContacts, AFastBodyHasContactsWhereItArrivesInTheStep) {
  const HalfSpaceField plane;
  StepMotion falls;
  falls.way = {0, 0, -0.01F};
  StepBody body = cube().at(0, 0, 0.026);
  body.motion = &falls;
  Step step;
  ASSERT_EQ(step.find(body, {plane, Pose()}, {}, 16), Status::ok);
  ASSERT_GE(step.contacts.size(), 4U);
  double least[2] = {};
  double most[2] = {};
  for (const StepContact& contact : step.contacts) {
    EXPECT_NEAR(contact.penetration, -0.006, 1e-4);
    EXPECT_NEAR(contact.position[2], 0.003, 1e-4);
    EXPECT_GT(contact.normal.z, 0.999F);
    for (int k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], contact.position[k]);
      most[k] = std::max(most[k], contact.position[k]);
    }
  }
  for (int k = 0; k < 2; ++k) EXPECT_GT(most[k] - least[k], 0.03);
  // The same motion of the ground, and motions that do not close the gap.
  StepMotion rises;
  rises.way = {0, 0, 0.01F};
  const std::size_t found = step.contacts.size();
  body.motion = nullptr;
  ASSERT_EQ(step.find(body, {plane, Pose(), nullptr, &rises}, {}, 16), Status::ok);
  EXPECT_EQ(step.contacts.size(), found);
  for (const Vec3 way : {Vec3{0, 0, 0.01F}, Vec3{0.01F, 0, 0}, Vec3{0, 0, -0.005F}}) {
    falls.way = way;
    body.motion = &falls;
    ASSERT_EQ(step.find(body, {plane, Pose()}, {}, 16), Status::ok);
    EXPECT_TRUE(step.contacts.empty()) << way.x << ' ' << way.z;
  }
  ASSERT_EQ(step.find(cube().at(0, 0, 0.026), {plane, Pose()}, {}, 16), Status::ok);
  EXPECT_TRUE(step.contacts.empty());
  // In scenes of kilometres, or in millimetres taken for metres.
  falls.way = {0, 0, -5000};
  StepBody high = cube().at(0, 0, 4000);
  high.motion = &falls;
  ASSERT_EQ(step.find(high, {plane, Pose()}, {}, 16), Status::ok);
  EXPECT_GE(step.contacts.size(), 4U);
  falls.way.x = std::nanf("");
  EXPECT_EQ(step.find(body, {plane, Pose()}), Status::bad_argument);
}

TEST(StepContacts, ABallIsFoundWhereverItTouchesABody) {
  Random random;
  Step step;
  const auto is_found_at = [&](const auto& field) {
    for (int n = 0; n < 40; ++n) {
      const Pose pose = random_pose(random, 1);
      const Pose other = random_pose(random, 1);
      // Of the ball's centre: from the field's, until its surface is 1 mm deep.
      const Vec3 way{static_cast<float>(other.rotation[2]), static_cast<float>(other.rotation[5]),
                     static_cast<float>(other.rotation[8])};
      float in = 0;
      float out = 1;
      for (int i = 0; i < 30; ++i) {
        const float middle = (in + out) / 2;
        const bool touches = penetration(field, {middle * way.x, middle * way.y, middle * way.z}) > -0.019F;
        (touches ? in : out) = middle;
      }
      const auto centre = moved(pose, {double{in * way.x}, double{in * way.y}, double{in * way.z}});
      ASSERT_EQ(step.find(ball().at(centre[0], centre[1], centre[2]), {field, pose}), Status::ok);
      EXPECT_FALSE(step.contacts.empty()) << n;
    }
  };
  using Profile = RevolvedField::Profile;
  is_found_at(BoxField{{0.03F, 0.02F, 0.01F}});
  is_found_at(SphereField{0.03F});
  is_found_at(RevolvedField{Profile::capsule, 0.01F, 0.03F, 0});
  is_found_at(RevolvedField{Profile::cylinder, 0.03F, 0.01F, 0.002F});
  is_found_at(RevolvedField{Profile::cone, 0.02F, 0.03F, 0.002F});
}

TEST(StepContacts, ACapsuleAcrossAnEdgeIsFound) {
  constexpr float kAcross = 0.01F;
  constexpr float kHalf = 0.015F;
  Random random;
  Step step;
  for (int n = 0; n < 300; ++n) {
    Pose pose = random_pose(random, 1);
    const Pose other = random_pose(random, 1);
    const auto depth_at = [&](double way) {
      for (int i = 0; i < 3; ++i) pose.translation[i] = way * other.rotation[3 * i + 2];
      double nearest = 1;
      for (int k = -60; k <= 60; ++k) {
        double squared = 0;
        for (int i = 0; i < 3; ++i) {
          const double at = pose.translation[i] + double{kHalf} * k / 60 * pose.rotation[3 * i + 2];
          squared += std::pow(std::max(std::abs(at) - 0.02, 0.0), 2);
        }
        nearest = std::min(nearest, std::sqrt(squared));
      }
      return double{kAcross} - nearest;
    };
    double in = 0;
    double out = 1;
    for (int i = 0; i < 30; ++i) {
      const double middle = (in + out) / 2;
      (depth_at(middle) > 0.7 * kVoxelSize ? in : out) = middle;
    }
    const double depth = depth_at(in);
    const RevolvedField capsule{RevolvedField::Profile::capsule, kAcross, kHalf, 0};
    ASSERT_EQ(step.find(cube().at(0, 0, 0), {capsule, pose}), Status::ok);
    float deepest = -1;
    for (const StepContact& contact : step.contacts) deepest = std::max(deepest, contact.penetration);
    EXPECT_NEAR(deepest, depth, 0.3 * kVoxelSize) << n;
  }
}

TEST(StepContacts, TheTipOfAConeIsFoundBetweenThePoints) {
  Step step;
  const RevolvedField cone{RevolvedField::Profile::cone, 0.004F, 0.02F, 0};
  Pose pose = turned_about_x(std::numbers::pi);
  pose.translation[2] = 0.04 - 0.4 * kVoxelSize;
  for (int n = 0; n < 10; ++n) {
    pose.translation[0] = 3.7e-4 * n;
    pose.translation[1] = -2.3e-4 * n;
    ASSERT_EQ(step.find(cube().at(0, 0, 0), {cone, pose}), Status::ok);
    ASSERT_FALSE(step.contacts.empty()) << n;
    EXPECT_NEAR(step.contacts[0].penetration, 0.4 * kVoxelSize, 0.1 * kVoxelSize) << n;
  }
}

TEST(StepContacts, RefusesWhatItCannotAnswer) {
  const HalfSpaceField plane;
  const SphereField sphere{0.01F};
  Step step;
  EXPECT_EQ(step.find({plane, Pose()}, {sphere, Pose()}), Status::missing_part);
  const VoxelmapView none;
  EXPECT_EQ(step.find({none, Pose(), &cube().shell}, {none, Pose(), &ball().shell}), Status::missing_part);
  EXPECT_EQ(step.find({none, pose_at(0, 0, 0.0199), &cube().shell}, {plane, Pose()}), Status::ok);
  EXPECT_EQ(step.contacts.size(), 4U);
  EXPECT_EQ(step.find(cube().at(0, 0, 0), {plane, Pose()}, {}, 0), Status::bad_argument);
  EXPECT_EQ(step.find(cube().at(0, 0, 0), {plane, Pose()}, {-1}), Status::bad_argument);
  EXPECT_EQ(step.find(cube().at(0, 0, 0), {plane, Pose()}, {std::nanf("")}), Status::bad_argument);
  EXPECT_EQ(step.find(cube().at(std::nan(""), 0, 0), {plane, Pose()}), Status::bad_pose);
  EXPECT_TRUE(step.contacts.empty());
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Solids on flat baked ground, against their contacts with a plane.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/vps_contacts.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kUnit = 0.004;  // voxel of the ground. [m]
constexpr double kUnder = 0.02;  // from the middle of the ground to its top. [m]
constexpr double kDeep = 0.0005;

// A slab that is oblique in the grid of its samples.
struct ObliqueGround {
  Pose turn = turned_about_two_axes();
  std::shared_ptr<Asset> asset;
  PointshellView shell;
  VoxelmapView map;
  ObliqueGround() {
    bake::BakeOptions options;
    options.voxel_size = kUnit;
    asset = baked(moved(turn, make_box({0.3, 0.3, kUnder})), options);
    EXPECT_EQ(asset->pointshell(shell), Status::ok);
    EXPECT_EQ(asset->voxelmap(map), Status::ok);
  }
  // Level, with its top at z = 0.
  [[nodiscard]] StepBody body() const {
    Pose pose;
    for (int i = 0; i < 9; ++i) pose.rotation[i] = turn.rotation[3 * (i % 3) + i / 3];
    pose.translation[2] = -kUnder;
    return {map, pose, &shell};
  }
};

// @param lowest  of the solid's places, in the world, below its frame's origin. [m]
void expect_contacts_of_plane(const ObliqueGround& ground, FieldRef solid, Pose pose, double lowest,
                              std::size_t least) {
  pose.translation[2] = lowest - kDeep;
  StepContact room[4];
  std::span<StepContact> found(room);
  StepScratch scratch;
  StepMemory memory;
  const StepMotion stands;
  const StepOptions options{0, StepUse::constraints, &memory};
  ASSERT_EQ(step_contacts({solid, pose, nullptr, &stands}, ground.body(), options, scratch, found), Status::ok);
  ASSERT_GE(found.size(), least);
  EXPECT_NEAR(found[0].penetration, kDeep, 0.03 * kUnit);
  for (std::size_t i = 0; i + 1 < least; ++i) {
    for (std::size_t k = i + 1; k < least; ++k) {
      EXPECT_GT(std::hypot(found[i].position[0] - found[k].position[0], found[i].position[1] - found[k].position[1]),
                0.02);
    }
  }
  for (const StepContact& contact : found) {
    EXPECT_LE(contact.penetration, kDeep + 0.03 * kUnit);
    EXPECT_NEAR(contact.position[2], -contact.penetration / 2, 0.03 * kUnit);
    EXPECT_NEAR(contact.normal.x, 0, 5e-4);
    EXPECT_NEAR(contact.normal.y, 0, 5e-4);
  }
}

class SolidOnPlane : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { ground_ = new ObliqueGround; }
  static void TearDownTestSuite() {
    delete ground_;
    ground_ = nullptr;
  }
  // In any rotation, at any place of the ground.
  template <class Lowest>
  static void turn_about(FieldRef solid, const Lowest& lowest) {
    Random random;
    for (int n = 0; n < 50; ++n) {
      const Pose pose = random_pose(random, 0.15);
      const double* const up = pose.rotation + 6;
      expect_contacts_of_plane(*ground_, solid, pose, lowest({up[0], up[1], up[2]}), 1);
    }
  }
  static const ObliqueGround* ground_;
};
const ObliqueGround* SolidOnPlane::ground_ = nullptr;

using Up = std::array<double, 3>;  // solid's frame

TEST_F(SolidOnPlane, ItsDeepestPlacesMeetThePlane) {
  using Profile = RevolvedField::Profile;
  turn_about(BoxField{{0.04F, 0.03F, 0.02F}},
             [](const Up& up) { return 0.04 * std::abs(up[0]) + 0.03 * std::abs(up[1]) + 0.02 * std::abs(up[2]); });
  turn_about(SphereField{0.03F}, [](const Up&) { return double{0.03F}; });
  turn_about(RevolvedField{Profile::capsule, 0.02F, 0.03F, 0},
             [](const Up& up) { return 0.02 + 0.03 * std::abs(up[2]); });
  turn_about(RevolvedField{Profile::cylinder, 0.02F, 0.03F, 0.002F},
             [](const Up& up) { return 0.002 + 0.02 * std::hypot(up[0], up[1]) + 0.03 * std::abs(up[2]); });
  turn_about(RevolvedField{Profile::cone, 0.02F, 0.03F, 0.002F}, [](const Up& up) {
    return 0.002 + std::max(0.02 * std::hypot(up[0], up[1]) + 0.03 * up[2], -0.03 * up[2]);
  });
}

TEST_F(SolidOnPlane, ThoseThatStandHaveContactsAllAround) {
  using Profile = RevolvedField::Profile;
  expect_contacts_of_plane(*ground_, BoxField{{0.04F, 0.03F, 0.02F}}, pose_at(0.01, 0.02, 0), 0.02, 4);
  const RevolvedField cylinder{Profile::cylinder, 0.02F, 0.03F, 0};
  expect_contacts_of_plane(*ground_, cylinder, pose_at(0.01, 0.02, 0), 0.03, 4);
  expect_contacts_of_plane(*ground_, cylinder, turned_about_x(std::numbers::pi / 2), 0.02, 2);
  expect_contacts_of_plane(*ground_, RevolvedField{Profile::cone, 0.02F, 0.03F, 0}, pose_at(0.01, 0.02, 0), 0.03, 4);
  expect_contacts_of_plane(*ground_, RevolvedField{Profile::capsule, 0.02F, 0.03F, 0},
                           turned_about_x(std::numbers::pi / 2), 0.02, 2);
}

// The middle of a ball in which the plane is sought may be on the other side of the plate.
TEST(ThinPlate, PushesBodiesToTheirSide) {
  bake::BakeOptions options;
  options.voxel_size = 0.01;
  const std::shared_ptr<Asset> plate = baked(make_box({0.5, 0.5, 0.01}, {0, 0, 0.015}), options);
  options.voxel_size = 0.002;
  const std::shared_ptr<Asset> cube = baked(make_box({0.01, 0.01, 0.01}), options);
  PointshellView plate_shell;
  PointshellView cube_shell;
  VoxelmapView plate_map;
  VoxelmapView cube_map;
  ASSERT_EQ(plate->pointshell(plate_shell), Status::ok);
  ASSERT_EQ(plate->voxelmap(plate_map), Status::ok);
  ASSERT_EQ(cube->pointshell(cube_shell), Status::ok);
  ASSERT_EQ(cube->voxelmap(cube_map), Status::ok);
  const SphereField ball{0.012F};
  const BoxField box{{0.01F, 0.01F, 0.01F}};
  Random random;
  for (int n = 0; n < 100; ++n) {
    const double side = n % 2 == 0 ? 1 : -1;
    const double x = random.between(-0.3, 0.3);
    const double y = random.between(-0.3, 0.3);
    const auto at = [&](double half) { return pose_at(x, y, 0.015 + side * (0.01 + half - kDeep)); };
    for (const StepBody& body : {StepBody{ball, at(double{ball.radius})}, StepBody{box, at(0.01)},
                                 StepBody{cube_map, at(0.01), &cube_shell}}) {
      StepMemory memory;
      StepScratch scratch;
      for (int step = 0; step < 2; ++step) {
        StepContact room[4];
        std::span<StepContact> found(room);
        ASSERT_EQ(
            step_contacts(body, {plate_map, Pose(), &plate_shell}, {0, StepUse::constraints, &memory}, scratch, found),
            Status::ok);
        ASSERT_FALSE(found.empty());
        EXPECT_GT(side * found[0].normal.z, 0.99) << n << ", step " << step;
        EXPECT_NEAR(found[0].penetration, kDeep, 1e-3) << n << ", step " << step;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/vps_haptics.h"
#include "tests/support/baked.h"
#include "tests/support/random.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

// The pointshell of a tool and a voxelmap, baked from two meshes.
struct Bench {
  std::shared_ptr<Asset> tool_asset, map_asset;
  PointshellView tool;
  VoxelmapView map;
  Bench(const TriangleMesh& tool_mesh, const TriangleMesh& map_mesh, double voxel_size) {
    bake::BakeOptions options;
    options.voxel_size = voxel_size;
    tool_asset = baked(tool_mesh, options);
    map_asset = baked(map_mesh, options);
    EXPECT_EQ(tool_asset->pointshell(tool), Status::ok);
    EXPECT_EQ(map_asset->voxelmap(map), Status::ok);
  }
};
// The slab's top is at z = 0.
Bench box_on_slab() {
  return {make_box({0.02, 0.02, 0.02}, {0.01, 0, 0}), make_box({0.1, 0.1, 0.02}, {0, 0, -0.02}), 0.002};
}
Pose at(double x, double y, double z) {
  Pose pose;
  pose.translation[0] = x;
  pose.translation[1] = y;
  pose.translation[2] = z;
  return pose;
}

TEST(VirtualTool, NothingIsFeltInTheAirAndTheToolFollowsTheHandle) {
  const Bench s = box_on_slab();
  VirtualTool tool(s.tool, s.map, at(0, 0, 0.05), {});
  HapticCycle cycle;
  for (int i = 0; i < 100; ++i) {
    Pose device = at(1e-4 * i, -2e-4 * i, 0.05);
    const double angle = 0.01 * i;
    device.rotation[0] = device.rotation[4] = std::cos(angle);
    device.rotation[1] = -std::sin(angle);
    device.rotation[3] = std::sin(angle);
    ASSERT_EQ(tool.step(device, cycle), Status::ok);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(cycle.felt.force[axis], 0, 1e-4);
      EXPECT_NEAR(cycle.felt.torque[axis], 0, 1e-6);
      EXPECT_NEAR(cycle.tool.translation[axis], device.translation[axis], 1e-7);
    }
  }
}

TEST(VirtualTool, APressedToolStaysOutAndRendersTheSpringsStiffness) {
  const Bench s = box_on_slab();
  CouplingOptions options;
  options.linear_stiffness = 1500;
  VirtualTool tool(s.tool, s.map, at(0, 0, 0.021), options);
  double at_1mm = 0;
  HapticCycle cycle;
  for (int i = 0; i <= 1000; ++i) {
    const double deep = 0.006 * i / 1000 - 0.001;
    ASSERT_EQ(tool.step(at(0, 0, 0.02 - deep), cycle), Status::ok);
    if (deep > 1e-4) {
      EXPECT_NEAR(cycle.felt.force[2], 1500 * deep, 1500 * 3e-5) << i;  // the field's error
      EXPECT_NEAR(cycle.felt.force[0], 0, 0.02);
      EXPECT_LT(cycle.penetration, 1e-5);
    }
    if (i == 333) at_1mm = cycle.felt.force[2];
  }
  const double rendered = (cycle.felt.force[2] - at_1mm) / (0.005 - (0.006 * 0.333 - 0.001));
  EXPECT_NEAR(rendered, 1500, 3);
  // No force remains when the hand lifts off.
  for (int i = 0; i < 5; ++i) ASSERT_EQ(tool.step(at(0, 0, 0.03), cycle), Status::ok);
  EXPECT_NEAR(cycle.felt.force[2], 0, 1e-3);
}

TEST(VirtualTool, AClosedWayGivesNoEnergy) {
  const Bench s = box_on_slab();
  VirtualTool tool(s.tool, s.map, at(0, 0, 0.022), {});
  HapticCycle cycle;
  double work = 0;  // on the hand
  double largest = 0;
  Pose last = at(0, 0, 0.022);
  for (int i = 1; i <= 4000; ++i) {
    const double phase = 2 * 3.14159265358979 * i / 1000;
    const Pose device = at(0.004 * std::sin(phase), 0.002 * std::sin(2 * phase), 0.02 + 0.002 * std::cos(phase));
    ASSERT_EQ(tool.step(device, cycle), Status::ok);
    for (int axis = 0; axis < 3; ++axis) {
      work += cycle.felt.force[axis] * (device.translation[axis] - last.translation[axis]);
    }
    largest = std::max(largest, std::abs(work));
    last = device;
  }
  EXPECT_GT(largest, 1e-3);  // 4 N over 2 mm
  EXPECT_LT(work, 0.02 * largest);
}

TEST(VirtualTool, APegFindsItsHoleByTheWalls) {
  // The clearance is 0.1 mm all round, and the hand is 0.5 mm beside the axis.
  const Bench s(samples::make_peg(), samples::make_hole(), 0.0004);
  const auto& peg = s.tool_asset->info();
  const auto& hole = s.map_asset->info();
  const double above = hole.bounds_max[2] - peg.bounds_min[2];
  const double start_x = 0.5 * (hole.bounds_min[0] + hole.bounds_max[0] - peg.bounds_min[0] - peg.bounds_max[0]);
  const double start_y = 0.5 * (hole.bounds_min[1] + hole.bounds_max[1] - peg.bounds_min[1] - peg.bounds_max[1]);
  CouplingOptions options;
  options.angular_stiffness = 5;
  VirtualTool tool(s.tool, s.map, at(start_x, start_y, above - 0.003), options);
  HapticCycle cycle;
  for (int i = 0; i < 1000; ++i) {
    const double in = 0.003 + 0.01 * i / 1000;
    const double aside = std::min(0.0005, 1e-6 * i);
    ASSERT_EQ(tool.step(at(start_x + aside, start_y, above - in), cycle), Status::ok);
    ASSERT_LT(cycle.penetration, 3e-5) << i;
  }
  EXPECT_NEAR(cycle.tool.translation[0] - start_x, 1e-4, 4e-5);
  EXPECT_NEAR(cycle.tool.translation[2], above - 0.013, 2e-4);
  EXPECT_NEAR(cycle.felt.force[0], -2000 * 4e-4, 0.2);
}

TEST(VirtualTool, TheFeltForceIsNoMoreThanTheDeviceGivesAndJumpsDoNotPassWalls) {
  const Bench s = box_on_slab();
  CouplingOptions options;
  options.max_force = 5;
  VirtualTool tool(s.tool, s.map, at(0, 0, 0.021), options);
  HapticCycle cycle;
  for (int i = 0; i < 200; ++i) ASSERT_EQ(tool.step(at(0, 0, -0.2), cycle), Status::ok);
  EXPECT_NEAR(std::hypot(cycle.felt.force[0], cycle.felt.force[1], cycle.felt.force[2]), 5, 1e-6);
  EXPECT_GT(cycle.tool.translation[2], 0.0185);
}

// A hammer: its centre of mass lies in the head, far from the middle of the root sphere, and its tip swings far.
TEST(VirtualTool, ATurningHandleDoesNotPassWalls) {
  const TriangleMesh hammer = joined(make_box({0.03, 0.03, 0.03}), make_box({0.13, 0.003, 0.003}, {0.1605, 0, 0}));
  const Bench s(hammer, make_box({0.002, 0.2, 0.2}), 0.002);
  const auto turned = [](double angle) {
    Pose pose = at(-0.18, -0.15, 0);
    pose.rotation[0] = pose.rotation[4] = std::cos(angle);
    pose.rotation[1] = -std::sin(angle);
    pose.rotation[3] = std::sin(angle);
    return pose;
  };
  const double upright = std::acos(0.0);
  VirtualTool tool(s.tool, s.map, turned(upright), {});
  HapticCycle cycle;
  for (int i = 0; i < 40; ++i) {
    ASSERT_EQ(tool.step(turned(upright - 1), cycle), Status::ok);
    EXPECT_LT(cycle.penetration, 1e-4);
    EXPECT_LT(cycle.tool.translation[0] + 0.29 * cycle.tool.rotation[0], 0);  // tip
  }
}

// Turning is far softer than moving for a tool of a metre: the sweeps over its contacts do not converge.
TEST(VirtualTool, ALargeToolThatIsPushedStaysOut) {
  const TriangleMesh tool_mesh = joined(make_box({0.6, 0.15, 0.15}), make_box({0.15, 0.6, 0.15}, {0.4, 0.4, 0}));
  const Bench s(tool_mesh, make_box({0.5, 0.4, 0.3}), 0.03);
  Random random(1);
  for (int start = 0; start < 6; ++start) {
    Pose device;
    const std::array<double, 9> turn = random.rotation();
    std::copy(turn.begin(), turn.end(), device.rotation);
    const std::array<double, 9> towards = random.rotation();
    const auto move_to = [&](double far) {
      for (int axis = 0; axis < 3; ++axis) device.translation[axis] = far * towards[3 * axis];
    };
    move_to(2);
    VirtualTool tool(s.tool, s.map, device, {});
    HapticCycle cycle;
    double deepest = 0;
    for (int i = 0; i < 500; ++i) {
      move_to(2 - 0.004 * i);
      ASSERT_EQ(tool.step(device, cycle), Status::ok);
      deepest = std::max(deepest, double(cycle.penetration));
    }
    EXPECT_LT(deepest, 0.25 * 0.03) << start;
    // It comes free again.
    for (int i = 0; i < 100; ++i) {
      move_to(0.02 * i);
      ASSERT_EQ(tool.step(device, cycle), Status::ok);
    }
    move_to(2);
    for (int i = 0; i < 20; ++i) ASSERT_EQ(tool.step(device, cycle), Status::ok);
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_NEAR(cycle.tool.translation[axis], device.translation[axis], 1e-3) << start;
    }
  }
}

TEST(VirtualTool, BadUseGetsAStatusAndTheToolStays) {
  const Bench s = box_on_slab();
  CouplingOptions options;
  VirtualTool tool(s.tool, s.map, at(0, 0, 0.03), options);
  HapticCycle cycle;
  Pose device = at(std::numeric_limits<double>::quiet_NaN(), 0, 0);
  EXPECT_EQ(tool.step(device, cycle), Status::bad_pose);
  EXPECT_EQ(cycle.tool.translation[2], 0.03);
  EXPECT_EQ(cycle.felt.force[2], 0);
  options.linear_stiffness = 0;
  VirtualTool limp(s.tool, s.map, at(0, 0, 0.03), options);
  EXPECT_EQ(limp.step(at(0, 0, 0.03), cycle), Status::bad_argument);
  PointshellView none;
  VirtualTool nothing(none, s.map, at(0, 0, 0.03), {});
  EXPECT_EQ(nothing.step(at(0, 0, 0.03), cycle), Status::missing_part);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// The plane that stands for flat baked ground, against the true distance.
#include "runtime/contacts/wide_face.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "cli/lab/oracle.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/linear_part.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kGroundVoxel = 0.004;
constexpr double kHalf = 0.3, kThick = 0.03;  // half extents of the ground. [m]

struct FlatGround {
  const char* name;
  TriangleMesh mesh;
  int least;       // poses with a plane
  Pose turn = {};  // of the ground in its grid
};

// A slab with a hole of three voxels in (0.05, 0.03), which places of a fit may miss.
TriangleMesh slab_with_hole() {
  const auto beam = [](double low_x, double high_x, double low_y, double high_y) {
    return make_box({(high_x - low_x) / 2, (high_y - low_y) / 2, kThick},
                    {(high_x + low_x) / 2, (high_y + low_y) / 2, 0});
  };
  return joined(joined(beam(-kHalf, 0.043, -kHalf, kHalf), beam(0.057, kHalf, -kHalf, kHalf)),
                joined(beam(0, 0.1, -kHalf, 0.024), beam(0, 0.1, 0.036, kHalf)));
}

std::vector<FlatGround> flat_grounds() {
  const TriangleMesh slab = make_box({kHalf, kHalf, kThick});
  const auto slot = [](double x) {  // at x, of one and a half voxels
    const double left = (kHalf + x - 0.003) / 2;
    const double right = (kHalf - x - 0.003) / 2;
    return joined(make_box({left, kHalf, kThick}, {left - kHalf, 0, 0}),
                  make_box({right, kHalf, kThick}, {kHalf - right, 0, 0}));
  };
  const TriangleMesh room = joined(slab, make_box({0.02, kHalf, 0.1}, {-kHalf, 0, 0.1}));
  const auto above = [&](double height) {  // a plate of half a voxel that floats
    return joined(slab, make_box({0.02, 0.03, 0.001}, {0.05, 0.03, kThick + height}));
  };
  const Pose oblique = turned_about_two_axes();
  const TriangleMesh hole = slab_with_hole();
  const TriangleMesh bump = joined(slab, make_box({0.006, 0.006, 0.002}, {0.05, 0.03, kThick}));
  return {{"slab", slab, 150},
          {"slot", slot(0), 50},
          {"slot in the middle of cells", slot(0.008), 50},
          {"slot between cells", slot(0.0045), 50},
          {"wall", room, 100},
          {"bump of half a voxel", bump, 50},
          {"hole", hole, 50},
          {"doubly oblique hole", moved(oblique, hole), 20, oblique},
          {"oblique slab", moved(turned_about_y(0.4), slab), 50, turned_about_y(0.4)},
          {"oblique slab with a wall", moved(turned_about_y(0.4), room), 20, turned_about_y(0.4)},
          {"oblique slab with a bump", moved(turned_about_y(0.4), bump), 20, turned_about_y(0.4)},
          {"doubly oblique slab", moved(oblique, slab), 50, oblique},
          {"doubly oblique slab with a wall", moved(oblique, room), 20, oblique},
          {"doubly oblique slab with a bump", moved(oblique, bump), 20, oblique},
          {"doubly oblique slot", moved(oblique, slot(0)), 20, oblique},
          {"plate, close", above(0.0025), 50},
          {"plate, one voxel above", above(0.005), 50},
          {"plate, two voxels above", above(0.009), 50},
          {"plate, three voxels above", above(0.013), 50},
          {"oblique plate, one voxel above", moved(oblique, above(0.005)), 20, oblique},
          {"oblique plate, two voxels above", moved(oblique, above(0.009)), 20, oblique},
          {"torus", make_torus(0.25, 0.06, 60, 30), 0}};
}

TEST(WideFace, ThePlaneOfFlatGroundHasTheTrueDistances) {
  bake::BakeOptions options;
  options.voxel_size = 0.002;
  const auto ball = baked(make_sphere(0.02, 4), options);
  PointshellView shell;
  VoxelmapView distances;
  ASSERT_EQ(ball->pointshell(shell), Status::ok);
  ASSERT_EQ(ball->voxelmap(distances), Status::ok);
  options.voxel_size = kGroundVoxel;
  for (const FlatGround& ground : flat_grounds()) {
    const auto asset = baked(ground.mesh, options);
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, Field::scaled), Status::ok);
    const lab::Oracle oracle(ground.mesh);
    Random random(11);
    const Pose back = relative_pose(ground.turn, Pose());
    detail::GroundMemory memory;
    const double allowed = 0.1 * kGroundVoxel + double{map.error} + 1e-5;
    int found = 0;
    for (int n = 0; n < 1500; ++n) {
      Pose pose = random_pose(random, kHalf);
      pose.translation[2] = kThick + random.between(0.01, 0.06);
      pose = relative_pose(back, pose);
      const double distance = random.between(0, 0.02);
      const detail::StepPair pair{shell, distances, pose, Pose(), 0.002, 0.002};
      const HalfSpaceField* const plane =
          detail::flat_ground(pair, detail::Partner{map}, static_cast<float>(distance), memory);
      if (plane == nullptr) continue;
      ++found;
      for (int k = 0; k < 30; ++k) {
        // A place on the ball, one that it may move to, and one at the surface below these.
        const auto point = static_cast<std::uint32_t>(random.between(0, 1) * (shell.points - 1));
        Vec3 p = detail::Transform(pose).apply(point_position(shell, point));
        const auto move = [&](double far) {
          const auto along = [&] { return static_cast<float>(random.between(-far, far) / std::sqrt(3)); };
          for (float* const x : {&p.x, &p.y, &p.z}) *x += along();
        };
        if (k % 3 > 0) move(distance);
        if (k % 3 > 1) {
          p = detail::Transform(back).apply(p);
          p.z = static_cast<float>(kThick + random.between(0, 0.3) * kGroundVoxel);
          p = detail::Transform(ground.turn).apply(p);
        }
        const Vec3 centre = detail::Transform(pose).apply(sphere_centre(shell, 0));
        const double from_centre = std::hypot(p.x - centre.x, p.y - centre.y, p.z - centre.z);
        const double farthest = double{sphere_radius(shell, 0)} + distance - from_centre;  // that is known
        if (farthest < 0) continue;
        const auto v = static_cast<double>(detail::value_at(*plane, p));
        if (v > kGroundVoxel) continue;
        const double truth = oracle.penetration({p.x, p.y, p.z});
        if (std::abs(v) < farthest) {
          // Below the plane the ball may end beside the rim of a hole.
          ASSERT_GE(truth, std::min(v, -v) - allowed) << ground.name << ' ' << n;
        }
        ASSERT_LE(truth, std::max(v + allowed, -farthest)) << ground.name << ' ' << n;
      }
    }
    EXPECT_GE(found, ground.least) << ground.name;
    if (ground.least == 0) {
      EXPECT_EQ(found, 0) << ground.name;
    }
  }
}

TEST(WideFace, APlaneEndsWhereAHoleBegins) {
  bake::BakeOptions options;
  options.voxel_size = kGroundVoxel;
  const auto asset = baked(slab_with_hole(), options);
  VoxelmapView map;
  ASSERT_EQ(asset->voxelmap(map, Field::scaled), Status::ok);
  const HalfSpaceField top{{0, 0, 1}, static_cast<float>(kThick)};
  constexpr float kReach = 0.03F;
  const auto is_plane = [&](double x) {
    const Vec3 centre{static_cast<float>(x), 0.03F, static_cast<float>(kThick) + 0.01F};
    return detail::is_plane_within(map, top, centre, kReach, 0.05F * map.voxel_size, 1 << 14);
  };
  for (const double beside : {-0.02, -0.01, 0.0, 0.015}) EXPECT_FALSE(is_plane(0.05 + beside)) << beside;
  for (const double beside : {-0.06, 0.05, 0.1}) EXPECT_TRUE(is_plane(0.05 + beside)) << beside;
}

// Two roots with the same bricks, whose surface is z = 8, but for a step at the lower end of x. Of the first root the
// ball does not meet that end.
bool is_plane_over_equal_roots(float step) {
  constexpr float kLambda = 0.02F;
  std::vector<std::int8_t> codes;
  for (const float low : {0.0F, 8.0F}) {
    for (const float off : {step, 0.0F}) {
      for (std::uint32_t i = 0; i < kFieldSamples; ++i) {
        const float z = low + 2 * static_cast<float>(i / kFieldSlice);
        const float v = 8 - z - (i % kFieldEdge == 0 ? off : 0);
        codes.push_back(static_cast<std::int8_t>(std::clamp(std::round(v / (2 * kLambda)), -127.0F, 127.0F)));
      }
    }
  }
  codes.resize(codes.size() + 64);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < 16; ++i) {
    nodes.push_back(octree::brick_entry((i % 2 + 2 * (i / 4 % 2)) * kFieldEdge, kCoarsestLevel));
  }
  const std::uint32_t roots[] = {octree::node_entry(0), octree::node_entry(1)};
  VoxelmapView map;
  map.field = Field::scaled;
  map.element = ElementType::i8;
  map.values = codes.data();
  map.voxel_size = 1;
  map.lambda = map.error = kLambda;
  map.band_inner = map.band_outer = 2.5F;
  map.field_roots = roots;
  map.field_nodes = nodes.data();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    map.dims[axis] = axis == 0 ? 32 : 16;
    map.root_dims[axis] = axis == 0 ? 2 : 1;
    map.bounds_max[axis] = 16;
  }
  map.bounds_max[0] = 32;
  // Half a voxel between a place and the grid of samples.
  return detail::is_plane_within(map, {{0, 0, 1}, 8.5F}, {20, 8, 8.5F}, 6, 0.05F, 1 << 14);
}

TEST(WideFace, EqualBlocksAreNotAllMetInTheSamePart) {
  EXPECT_TRUE(is_plane_over_equal_roots(0));
  EXPECT_FALSE(is_plane_over_equal_roots(1));
}

// Each node leads to the next one in all octants, farther down than there are cubes.
TEST(WideFace, NodesThatGoOnAreNoPlane) {
  constexpr std::uint32_t kNodes = 1 << 18;
  std::vector<std::uint32_t> nodes(std::size_t{8} * kNodes, kFarOutside);
  for (std::uint32_t i = 0; i + 8 < nodes.size(); ++i) nodes[i] = octree::node_entry(i / 8 + 1);
  const std::uint32_t root = octree::node_entry(0);
  VoxelmapView map;
  map.field = Field::scaled;
  map.voxel_size = 1;
  map.lambda = map.error = 0.02F;
  map.band_inner = map.band_outer = 2.5F;
  map.field_roots = &root;
  map.field_nodes = nodes.data();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    map.dims[axis] = 16;
    map.root_dims[axis] = 1;
    map.bounds_min[axis] = 3;
    map.bounds_max[axis] = 12;
  }
  EXPECT_FALSE(detail::is_plane_within(map, {{0, 0, 1}, 8}, {8, 8, 8.5F}, 2, 0.05F, 1 << 14));
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/find_corners.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/vps_bake.h"
#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::test {

using namespace bake;
namespace {

// A cone with its tip at `height`, of 48 sides.
TriangleMesh cone(double radius, double height) {
  constexpr std::uint32_t kSides = 48;
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    mesh.vertices.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  mesh.vertices.push_back({0, 0, 0});
  mesh.vertices.push_back({0, 0, height});
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t next = (i + 1) % kSides;
    mesh.triangles.push_back({next, i, kSides});
    mesh.triangles.push_back({i, next, kSides + 1});
  }
  return mesh;
}

TriangleMesh tetrahedron(double half) {
  TriangleMesh mesh;
  mesh.vertices = {{half, half, half}, {half, -half, -half}, {-half, half, -half}, {-half, -half, half}};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return mesh;
}

// Positions of the corners that an asset has.
std::vector<Vec3> corners_in(const TriangleMesh& mesh, double voxel_size) {
  BakeOptions options;
  options.voxel_size = voxel_size;
  const std::shared_ptr<Asset> asset = baked(mesh, options);
  VoxelmapView map;
  EXPECT_EQ(asset->voxelmap(map), Status::ok);
  std::vector<Vec3> corners;
  for (const float* at = map.corner_places; corners.size() < map.corners; at += 3) {
    corners.push_back({at[0], at[1], at[2]});
  }
  return corners;
}

void expect_at(const std::vector<Vec3>& corners, const std::array<double, 3>& place) {
  const auto is_there = [&](Vec3 p) {
    return std::hypot(double{p.x} - place[0], double{p.y} - place[1], double{p.z} - place[2]) < 1e-5;
  };
  EXPECT_EQ(std::count_if(corners.begin(), corners.end(), is_there), 1)
      << place[0] << " " << place[1] << " " << place[2];
}

TEST(Corners, AreThoseOfPolyhedraAndTips) {
  const TriangleMesh box = make_box({0.02, 0.03, 0.01});
  const std::vector<Vec3> of_box = corners_in(box, 0.001);
  EXPECT_EQ(of_box.size(), 8U);
  for (const auto& vertex : box.vertices) expect_at(of_box, vertex);
  const TriangleMesh acute = tetrahedron(0.02);
  const std::vector<Vec3> of_acute = corners_in(acute, 0.001);
  EXPECT_EQ(of_acute.size(), 4U);
  for (const auto& vertex : acute.vertices) expect_at(of_acute, vertex);
  const std::vector<Vec3> of_cone = corners_in(cone(0.02, 0.03), 0.001);
  EXPECT_EQ(of_cone.size(), 1U);
  expect_at(of_cone, {0, 0, 0.03});
}

TEST(Corners, AreNeitherRoundNorBluntNorConcave) {
  EXPECT_TRUE(corners_in(make_sphere(0.02, 4), 0.001).empty());
  EXPECT_TRUE(corners_in(make_wheel(0.02, 0.005, 64), 0.001).empty());
  EXPECT_TRUE(corners_in(cone(0.02, 0.005), 0.001).empty()) << "of 152 degrees";
  // A step: of its twelve vertices the two on the inner edge are no corners.
  TriangleMesh step;
  const double outline[6][2] = {{0, 0}, {0.04, 0}, {0.04, 0.02}, {0.02, 0.02}, {0.02, 0.04}, {0, 0.04}};
  for (const double z : {0.0, 0.02}) {
    for (const auto& p : outline) step.vertices.push_back({p[0], p[1], z});
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t next = (i + 1) % 6;
    step.triangles.push_back({i, next, 6 + next});
    step.triangles.push_back({i, 6 + next, 6 + i});
  }
  for (const auto& [a, b, c] : {std::array{0U, 3U, 1U}, {1U, 3U, 2U}, {0U, 5U, 3U}, {3U, 5U, 4U}}) {
    step.triangles.push_back({a, b, c});
    step.triangles.push_back({6 + a, 6 + c, 6 + b});
  }
  EXPECT_EQ(corners_in(step, 0.001).size(), 10U);
}

TEST(Corners, MayBeRoundedOffByLessThanTwoVoxels) {
  for (const double radius : {0.0003, 0.001}) {
    const std::vector<Vec3> corners = corners_in(make_rounded_cube(0.02, radius), 0.001);
    EXPECT_EQ(corners.size(), 8U);
    const double tip = 0.02 - radius + radius / std::sqrt(3.0);
    for (const Vec3 p : corners) {
      for (const float x : {p.x, p.y, p.z}) EXPECT_NEAR(std::abs(x), tip, 0.3 * radius);
    }
  }
  // More than one place shows how round it is.
  const std::size_t on_larger = corners_in(make_rounded_cube(0.02, 0.0019), 0.001).size();
  EXPECT_GE(on_larger, 8U);
  EXPECT_LE(on_larger, 32U);
  EXPECT_TRUE(corners_in(make_rounded_cube(0.02, 0.005), 0.001).empty());
}

TEST(Corners, OfManyTheSharpestAreKept) {
  // Rows of spikes, the first one of blunter ones.
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < 20; ++i) {
    for (std::uint32_t k = 0; k < 20; ++k) {
      const TriangleMesh spike = cone(0.002, i == 0 ? 0.0015 : 0.004);
      const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
      for (const auto& [x, y, z] : spike.vertices) mesh.vertices.push_back({x + 0.005 * i, y + 0.005 * k, z});
      for (const auto& [a, b, c] : spike.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
    }
  }
  const std::vector<Vec3> corners = corners_in(mesh, 0.0005);
  EXPECT_EQ(corners.size(), kMostMeshCorners);
  EXPECT_TRUE(std::all_of(corners.begin(), corners.end(), [](Vec3 p) { return p.z > 0.0035F; }));
}

}  // namespace
}  // namespace vps::test

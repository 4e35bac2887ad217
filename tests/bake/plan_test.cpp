// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bake/stages/creases.h"
#include "bake/vps_bake.h"
#include "tests/support/shapes.h"

namespace vps::test {

using namespace bake;
namespace {

std::string refusal(const TriangleMesh& mesh, const BakeOptions& options) {
  try {
    (void)plan_bake(mesh, options);
  } catch (const BakeError& error) {
    EXPECT_EQ(error.stage, "plan");
    return error.what();
  }
  return "";
}

BakeOptions with_voxel(double s) {
  BakeOptions options;
  options.voxel_size = s;
  return options;
}

TEST(Plan, TheGridHoldsTheMeshAndItsBand) {
  const BakePlan plan = plan_bake(make_box({0.5, 0.25, 0.125}), with_voxel(0.01));
  EXPECT_EQ(plan.dims, (std::array<std::uint32_t, 3>{112, 64, 40}));
  EXPECT_EQ(plan.voxels, 112ULL * 64 * 40);
  EXPECT_GT(plan.predicted_memory_bytes, 100000U);
  EXPECT_GT(plan.predicted_points, 1000U);
}

TEST(Plan, ResolutionCountsVoxelsAlongTheLongestSide) {
  BakeOptions options;
  options.resolution = 50;
  EXPECT_DOUBLE_EQ(plan_bake(make_box({0.5, 0.25, 0.125}), options).voxel_size, 0.02);
}

TEST(Plan, AVoxelLargerThanTheMeshPointsToTheUnit) {
  const std::string why = refusal(make_box({0.001, 0.001, 0.001}), with_voxel(0.005));
  EXPECT_EQ(why,
            "a voxel of 5 mm is larger than the mesh, which is 2 mm x 2 mm x 2 mm; is the mesh's unit right? (--unit)");
}

TEST(Plan, AGridBeyondTheMemoryLimitPointsToTheUnit) {
  BakeOptions options = with_voxel(0.005);
  options.memory_limit_bytes = 1 << 20;
  const std::string why = refusal(make_box({0.5, 0.5, 0.5}), options);
  EXPECT_NE(why.find("more than the limit of 1.05 MB; is the mesh's unit right (--unit)?"), std::string::npos) << why;
  EXPECT_NE(refusal(make_box({500, 500, 500}), with_voxel(0.005)).find("is the mesh's unit right"), std::string::npos);
}

TEST(Plan, AMeshTooFarFromItsOriginForFloatsIsRefused) {
  EXPECT_NE(refusal(make_box({1, 1, 1}, {1e6, 0, 0}), with_voxel(0.1)).find("too far for voxels"), std::string::npos);
}

TEST(Plan, CreasesAreMeasuredByTheirAngle) {
  const TriangleMesh box = make_box({1, 2, 3});
  EXPECT_NEAR(measure_creases(box).sharp, 4 * (2 + 4 + 6), 1e-12);
  EXPECT_EQ(measure_creases(box).blunt, 0);
  // The same without shared vertices.
  TriangleMesh soup;
  for (const auto& t : box.triangles) {
    const auto base = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) soup.vertices.push_back(box.vertices[v]);
    soup.triangles.push_back({base, base + 1, base + 2});
  }
  EXPECT_NEAR(measure_creases(soup).sharp, 4 * (2 + 4 + 6), 1e-12);
  EXPECT_EQ(measure_creases(make_sphere(1, 4)).blunt, 0);
  // A tube of 12 sides: its blunt edges count in part. They are 12 rings with a mean radius of 1.
  const Creases ring = measure_creases(make_torus(1, 0.3, 4000, 12));
  EXPECT_NEAR(ring.blunt, 12 * 2 * std::numbers::pi, 0.05 * 12 * 2 * std::numbers::pi);
  EXPECT_EQ(ring.sharp, 0);
}

TEST(Plan, CreasesAndThinWallsTakeMemory) {
  // A block, a plate that lies wholly in the band, and bars, all of the same area (bars: 2 % less).
  const double block = 0.4;
  const double area = 24 * block * block;
  const double plate = std::sqrt((area - 4 * 2 * 0.4 * 0.01) / 8);
  const auto memory = [](const TriangleMesh& mesh) {
    BakeOptions options = with_voxel(0.005);
    options.pointshell = false;
    return plan_bake(mesh, options).predicted_memory_bytes;
  };
  TriangleMesh bars;
  for (int n = 0; n < 14; ++n) bars = joined(bars, make_box({0.4, 0.04, 0.04}, {0, 0.2 * n, 0}));
  EXPECT_GT(memory(make_box({plate, plate, 0.01})), memory(make_box({block, block, block})) * 3 / 2);
  EXPECT_GT(memory(bars), memory(make_box({block, block, block})) * 3 / 2);
}

TEST(Plan, OptionsOutOfRangeAreRefused) {
  const TriangleMesh mesh = make_box({1, 1, 1});
  BakeOptions options = with_voxel(0.1);
  options.branching = 1;
  EXPECT_NE(refusal(mesh, options).find("branching"), std::string::npos);
  options = with_voxel(0.1);
  options.band_outside = 1;
  EXPECT_NE(refusal(mesh, options).find("band"), std::string::npos);
  options = with_voxel(0.1);
  options.voxelmap = options.pointshell = false;
  EXPECT_NE(refusal(mesh, options).find("nothing to bake"), std::string::npos);
  options = with_voxel(0.1);
  options.scaled = false;
  EXPECT_NE(refusal(mesh, options).find("needs a field"), std::string::npos);
  options = with_voxel(0.1);
  options.precision = 16;
  EXPECT_NE(refusal(mesh, options).find("precision"), std::string::npos);
  EXPECT_NE(refusal(mesh, BakeOptions{}).find("voxel size"), std::string::npos);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "bake/vps_bake.h"
#include "tests/support/shapes.h"

namespace vps::test {
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

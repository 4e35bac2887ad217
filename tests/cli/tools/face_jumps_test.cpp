// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/face_jumps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/fields/penetration.h"
#include "sample_meshes/shapes.h"
#include "tests/support/baked.h"
#include "tests/support/random.h"

namespace vps::test {
namespace {

TEST(FaceJumps, NoPlaceOnAFaceHasALargerOne) {
  const bake::BakeOptions options = all_fields(0.1);
  const std::shared_ptr<Asset> asset = baked(samples::make_box({1, 1, 1}), options);
  for (const auto& [field, found_jump] : cli::face_jumps(*asset)) {
    const auto& jump = found_jump;  // lambdas may not capture the other
    VoxelmapView map;
    ASSERT_EQ(asset->voxelmap(map, field), Status::ok);
    const detail::CertifiedBand band = detail::certified_band(map);
    // Faces of bricks lie on planes through the centres of voxels.
    Random random;
    float found = 0;
    for (int n = 0; n < 300000; ++n) {
      float p[3];
      for (float& x : p) x = float(random.between(-1.3, 1.3));
      const int axis = n % 3;
      const double voxel = std::round((double(p[axis]) - map.origin[axis]) / options.voxel_size - 0.5);
      const double plane = map.origin[axis] + options.voxel_size * (voxel + 0.5);
      float v[2];
      for (const int side : {0, 1}) {
        p[axis] = float(plane + (side - 0.5) * 1e-5);
        v[side] = penetration(map, {p[0], p[1], p[2]}, {});
      }
      if (std::min(v[0], v[1]) <= -band.outer || std::max(v[0], v[1]) >= band.inner) continue;
      found = std::max(found, std::abs(v[1] - v[0]));
    }
    EXPECT_GT(jump.largest, 0.05 * options.voxel_size);
    EXPECT_LE(found, jump.largest + 2e-5);
    EXPECT_GE(found, 0.8 * jump.largest);
    // The place has it.
    const auto at = [&](double dx, double dy, double dz) {
      return penetration(map, {float(jump.place[0] + dx), float(jump.place[1] + dy), float(jump.place[2] + dz)}, {});
    };
    float low = at(0, 0, 0), high = low;
    for (int corner = 0; corner < 8; ++corner) {
      const float v = at(corner & 1 ? 1e-5 : -1e-5, corner & 2 ? 1e-5 : -1e-5, corner & 4 ? 1e-5 : -1e-5);
      low = std::min(low, v);
      high = std::max(high, v);
    }
    EXPECT_NEAR(high - low, jump.largest, 1e-4);
  }
}

// Eight cubes of one root share a brick, whose V rises along x.
TEST(FaceJumps, EqualBricksSideBySideAreTwo) {
  constexpr float kLambda = 0.02F;
  std::vector<std::int8_t> codes(kFieldSamples + 64);
  for (std::uint32_t i = 0; i < kFieldSamples; ++i) codes[i] = static_cast<std::int8_t>(5 * (i % kFieldEdge));
  const std::vector<std::uint32_t> nodes(8, octree::brick_entry(0, kCoarsestLevel));
  const std::uint32_t root = octree::node_entry(0);
  VoxelmapView map;
  map.field = Field::scaled;
  map.element = ElementType::i8;
  map.values = codes.data();
  map.voxel_size = 1;
  map.lambda = map.error = kLambda;
  map.band_inner = map.band_outer = 2.5F;
  map.field_roots = &root;
  map.field_nodes = nodes.data();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    map.dims[axis] = 16;
    map.root_dims[axis] = 1;
  }
  const cli::FaceJump jump = cli::largest_face_jump(map, 1);
  EXPECT_NEAR(jump.largest, 20 * 2 * kLambda, 1e-6);
  EXPECT_NEAR(jump.place[0], 8.5, 1e-6);
}

}  // namespace
}  // namespace vps::test

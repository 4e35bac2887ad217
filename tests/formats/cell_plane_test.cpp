// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/cell_plane.h"

#include <gtest/gtest.h>

#include "formats/octree.h"

namespace vps::test {
namespace {

TEST(CellPlane, EveryPlaneComesBackFromItsCode) {
  for (const int slope : {-kLargestSlope, -1, 0, 1, 40, kLargestSlope}) {
    for (const int height : {-kLargestHeight, -1, 0, 1, 300, kLargestHeight}) {
      for (const bool wide : {false, true}) {
        for (int axis = 0; axis < 3; ++axis) {
          CellPlane plane{{7, -9, 11}, height, wide};
          plane.slope[axis] = slope;
          const CellPlane back = decode_plane(encode(plane));
          for (int other = 0; other < 3; ++other) EXPECT_EQ(back.slope[other], plane.slope[other]);
          EXPECT_EQ(back.height, plane.height);
          EXPECT_EQ(back.wide, plane.wide);
        }
      }
    }
  }
}

TEST(CellPlane, HasTheBitsOfTheFormat) {
  EXPECT_EQ(encode({{1, -1, 2}, -3, true}), 1U | 127U << 7 | 2U << 14 | 1021U << 21 | 1U << 31);
}

TEST(CellPlane, ABlocksPlaneComesBackNoLower) {
  for (const int slope : {-kLargestSlope, -1, 0, 1, 40, kLargestSlope}) {
    for (const int height : {-kLargestBlockHeight, -5, -4, -1, 0, 1, 301, kLargestBlockHeight}) {
      for (const bool inside : {false, true}) {
        const std::uint32_t code = encode_block({{slope, -9, 11}, height, false}, inside);
        EXPECT_EQ(octree::root_entry(code), inside ? kFarInside : kFarOutside);
        const CellPlane back = decode_block(code);
        EXPECT_EQ(back.slope[0], slope);
        EXPECT_EQ(back.slope[1], -9);
        EXPECT_EQ(back.slope[2], 11);
        EXPECT_GE(back.height, height);
        EXPECT_LT(back.height, height + 4);
        EXPECT_FALSE(octree::has_octant_planes(code));
        EXPECT_FALSE(back.wide);
      }
    }
  }
}

TEST(CellPlane, ABlocksHasTheBitsOfTheFormat) {
  EXPECT_EQ(encode_block({{1, -1, 2}, -10, false}, true), 1U | 127U << 7 | 2U << 14 | 254U << 21 | 1U << 30);
}

TEST(CellPlane, ItsHeightIsInVoxels) {
  const float from_centre[3] = {2, -4, 1};
  EXPECT_FLOAT_EQ(height_at({{30, 15, -60}, -80, false}, from_centre), 1 - 1 - 1 - 1.5625F);
  EXPECT_FLOAT_EQ(height_at({{30, 15, -60}, 3, false}, from_centre), 1 - 1 - 1 + 9.0F / 4096);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/octree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace vps::test {
namespace {

TEST(Octree, AnEntryIsABrickANodeOrNone) {
  for (const std::uint32_t entry : {kFarOutside, kFarInside}) {
    EXPECT_FALSE(octree::is_brick(entry) || octree::is_node(entry));
  }
  for (const std::uint32_t number : {0U, 1U, kMostNodes - 1}) {
    EXPECT_TRUE(octree::is_node(octree::node_entry(number)));
    EXPECT_FALSE(octree::is_brick(octree::node_entry(number)));
    EXPECT_EQ(octree::node_of(octree::node_entry(number)), number);
  }
}

// Every brick's slices: along each axis, with none to three left out at either end.
template <class Visit>
void for_each_slices(Visit visit) {
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t count = 2; count <= kFieldEdge; ++count) {
      visit(octree::Slices{axis, 0, count});
      visit(octree::Slices{axis, kFieldEdge - count, count});
    }
  }
}

TEST(Octree, ABricksEntryTellsItsLevelAndSlices) {
  for (const std::uint32_t number : {0U, 1U, kMostSlices - 1}) {
    for (int level = kFinestLevel; level <= kCoarsestLevel; ++level) {
      for_each_slices([&](const octree::Slices& slices) {
        const std::uint32_t entry = octree::brick_entry(number, level, slices);
        EXPECT_TRUE(octree::is_brick(entry) && !octree::is_node(entry));
        EXPECT_EQ(octree::slice_of(entry), number);
        EXPECT_EQ(octree::level_of(entry), level);
        const octree::Slices back = octree::slices_of(entry);
        EXPECT_EQ(back.axis, slices.axis);
        EXPECT_EQ(back.first, slices.first);
        EXPECT_EQ(back.count, slices.count);
      });
    }
  }
}

TEST(Octree, ASliceThatIsLeftOutHasTheSamplesOfTheNearestStoredOne) {
  constexpr std::uint32_t kFirst = 7;
  for_each_slices([&](const octree::Slices& slices) {
    const std::uint32_t entry = octree::brick_entry(kFirst, 0, slices);
    const auto expected = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      std::uint32_t at[3] = {x, y, z};
      at[slices.axis] = std::clamp(at[slices.axis], slices.first, slices.first + slices.count - 1) - slices.first;
      // z takes the place of the slices' axis.
      if (slices.axis == 0) return (std::size_t{kFirst + at[0]} * 5 + at[1]) * 5 + at[2];
      if (slices.axis == 1) return (std::size_t{kFirst + at[1]} * 5 + at[2]) * 5 + at[0];
      return (std::size_t{kFirst + at[2]} * 5 + at[1]) * 5 + at[0];
    };
    for (std::uint32_t n = 0; n < kFieldSamples; ++n) {
      const std::uint32_t x = n % 5, y = n / 5 % 5, z = n / 25;
      ASSERT_EQ(octree::sample_at(entry, x, y, z), expected(x, y, z)) << n;
      if (std::max({x, y, z}) == 4) continue;
      const octree::Corners corners = octree::corners_of(entry, {x, y, z});
      for (std::uint32_t k = 0; k < 8; ++k) {
        ASSERT_EQ(corners.number(k), expected(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))) << n << ' ' << k;
      }
    }
  });
}

// Two roots along each axis: seven of blocks without samples, with and without planes. Only the last has nodes, each in
// the same octant of its parent.
TEST(Octree, TheWalkEndsAtTheEntryThatCoversTheCell) {
  std::array<std::uint32_t, 8> roots;
  for (std::uint32_t n = 0; n < 8; ++n) roots[n] = 100 + n + (n % 2 == 0 ? 0 : kInsideFlag);
  roots[2] = kFarInside;
  roots[7] = octree::node_entry(0);
  constexpr std::uint32_t kOctant = 6;  // upper in y and z
  std::array<std::uint32_t, 32> nodes;
  for (std::uint32_t n = 0; n < nodes.size(); ++n) nodes[n] = octree::brick_entry(n, 0);
  for (std::uint32_t node = 0; node < 3; ++node) nodes[8 * node + kOctant] = octree::node_entry(node + 1);
  nodes[1] = kFarInside;
  const std::uint32_t root_dims[] = {2, 2};
  const auto find = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return octree::find_entry(roots.data(), nodes.data(), root_dims, {x, y, z});
  };
  EXPECT_EQ(find(0, 0, 0).entry, kFarOutside);
  EXPECT_EQ(find(31, 15, 15).entry, kFarInside);
  EXPECT_EQ(find(15, 16, 15).entry, kFarInside);
  EXPECT_EQ(find(15, 15, 16).entry, kFarOutside);
  EXPECT_EQ(find(15, 15, 16).edge, 16U);
  EXPECT_EQ(find(16, 16, 16).entry, nodes[0]);
  EXPECT_EQ(find(24, 23, 16).entry, kFarInside);
  EXPECT_EQ(find(24, 23, 16).edge, 8U);
  EXPECT_EQ(find(16 + 7, 31, 31).entry, nodes[8 + 7]);
  EXPECT_EQ(find(16 + 7, 31, 31).edge, 4U);
  EXPECT_EQ(find(16 + 3, 31, 31).edge, 2U);
  EXPECT_EQ(find(16 + 1, 31, 31).entry, nodes[24 + 7]);
  EXPECT_EQ(find(16, 31, 31).entry, nodes[24 + kOctant]);
  EXPECT_EQ(find(16, 31, 31).edge, 1U);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/fields/linear_brick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace vps::test {
namespace {

using detail::is_linear_brick;

// A linear function of the place over the samples of a brick.
struct LineOverBrick {
  float first = 0;
  float slope[3] = {};
};
constexpr LineOverBrick kV{3, {2, -1, 4}};

// With a tolerance of half a code.
bool is_linear(const VoxelmapView& map, std::uint32_t entry, const LineOverBrick& wanted, const LineOverBrick& height,
               float near) {
  detail::BrickTest test;
  test.step = 1;
  test.tolerance = 0.5F;
  test.near = near;
  std::copy_n(wanted.slope, 3, test.wanted);
  std::copy_n(height.slope, 3, test.height);
  return is_linear_brick(map, entry, test, wanted.first, height.first);
}

// Codes of kV in the slices of a brick that are stored.
struct Brick {
  std::uint32_t entry;
  std::array<std::int8_t, kFieldSamples> codes{};
  VoxelmapView map;

  explicit Brick(const octree::Slices& slices) : entry(octree::brick_entry(0, 0, slices)) {
    for (std::uint32_t n = 0; n < kFieldSamples; ++n) {
      const std::uint32_t at[3] = {n % 5, n / 5 % 5, n / 25};
      if (at[slices.axis] < slices.first || at[slices.axis] >= slices.first + slices.count) continue;
      const int v = 3 + 2 * int(at[0]) - int(at[1]) + 4 * int(at[2]);
      codes[octree::corners_of(entry, at).first] = static_cast<std::int8_t>(v);
    }
    map.element = ElementType::i8;
    map.values = codes.data();
  }
  [[nodiscard]] bool is_linear(const LineOverBrick& height, float near) const {
    return test::is_linear(map, entry, kV, height, near);
  }
};

TEST(LinearBrick, EverySampleNearThePlaneCountsAlsoOneThatIsLeftOut) {
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t count = 2; count <= kFieldEdge; ++count) {
      for (const std::uint32_t first : {0U, kFieldEdge - count}) {
        SCOPED_TRACE(testing::Message() << axis << ' ' << first << ' ' << count);
        Brick brick({axis, first, count});
        EXPECT_EQ(brick.is_linear({}, 1), count == kFieldEdge);
        // A plane amid the stored slices.
        const float half = 0.5F * static_cast<float>(count - 1);
        LineOverBrick height{-(static_cast<float>(first) + half), {}};
        height.slope[axis] = 1;
        EXPECT_TRUE(brick.is_linear(height, half + 0.9F));
        EXPECT_EQ(brick.is_linear(height, half + 1.1F), count == kFieldEdge);
        // The first and the last sample.
        for (const std::size_t n : {std::size_t{0}, std::size_t{count} * kFieldSlice - 1}) {
          ++brick.codes[n];
          EXPECT_FALSE(brick.is_linear(height, half + 0.9F));
          EXPECT_EQ(brick.is_linear(height, half - 0.1F), true);  // no longer near
          --brick.codes[n];
        }
      }
    }
  }
}

// Of a face's bricks most slices are left out along the face: they have the samples of the last one.
TEST(LinearBrick, SlicesThatAreLeftOutMayBeAsTheLastOne) {
  constexpr LineOverBrick kNear{};
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    for (std::uint32_t count = 2; count < kFieldEdge; ++count) {
      for (const std::uint32_t first : {0U, kFieldEdge - count}) {
        SCOPED_TRACE(testing::Message() << axis << ' ' << first << ' ' << count);
        Brick brick({axis, first, count});
        LineOverBrick v = kV;
        v.slope[axis] = 0;
        for (std::uint32_t n = 0; n < kFieldSamples; ++n) {
          const std::uint32_t at[3] = {n % 5, n / 5 % 5, n / 25};
          if (at[axis] < first || at[axis] >= first + count) continue;
          float value = v.first;
          for (int i = 0; i < 3; ++i) value += v.slope[i] * static_cast<float>(at[i]);
          brick.codes[octree::corners_of(brick.entry, at).first] = static_cast<std::int8_t>(value);
        }
        EXPECT_TRUE(is_linear(brick.map, brick.entry, v, kNear, 1));
        // The last slice that is left out is off by the slope times its way from the stored ones.
        const auto left_out = static_cast<float>(kFieldEdge - count);
        const float end = first > 0 ? static_cast<float>(first) : static_cast<float>(count - 1);
        for (const float off : {0.45F, 0.55F}) {
          LineOverBrick tilted = v;
          tilted.slope[axis] = off / left_out;
          tilted.first -= end * tilted.slope[axis];
          const bool stored_are = off / left_out * static_cast<float>(count - 1) < 0.5F;
          EXPECT_EQ(is_linear(brick.map, brick.entry, tilted, kNear, 1), stored_are && off < 0.5F);
        }
        // A sample of the last slice counts where only slices that are left out are near.
        LineOverBrick height{-(first > 0 ? 0.0F : 4.0F), {}};
        height.slope[axis] = 1;
        EXPECT_TRUE(is_linear(brick.map, brick.entry, v, height, 0.5F));
        brick.codes[first > 0 ? 7 : std::size_t{count} * kFieldSlice - 7] += 1;
        EXPECT_FALSE(is_linear(brick.map, brick.entry, v, height, 0.5F));
      }
    }
  }
}

}  // namespace
}  // namespace vps::test

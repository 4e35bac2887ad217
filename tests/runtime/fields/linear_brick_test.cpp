// SPDX-License-Identifier: GPL-3.0-or-later
#include "runtime/fields/linear_brick.h"

#include <gtest/gtest.h>

#include <array>

namespace vps::test {
namespace {

using detail::is_linear_brick;
using detail::LineOverBrick;

constexpr LineOverBrick kV{3, {2, -1, 4}};

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
    return is_linear_brick(map, entry, 1, kV, 0.5F, height, near);
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

}  // namespace
}  // namespace vps::test

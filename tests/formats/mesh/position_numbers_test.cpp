// SPDX-License-Identifier: GPL-3.0-or-later
#include "formats/mesh/position_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

namespace vps::test {
namespace {

using Position = std::array<double, 3>;

TEST(PositionNumbers, AreThoseOfAMapInTheOrderOfFirstUse) {
  std::mt19937 random(1);
  for (const std::size_t expected : {std::size_t{0}, std::size_t{7}, std::size_t{5000}}) {
    PositionNumbers<Position> numbers(expected);
    std::map<Position, std::uint32_t> known;
    for (int i = 0; i < 20000; ++i) {
      const auto coordinate = [&] { return (static_cast<double>(random() % 17) - 8) / 3; };
      const double x = coordinate(), y = coordinate();
      const Position p = {x, y, coordinate()};
      const auto number = static_cast<std::uint32_t>(known.size());
      EXPECT_EQ(numbers.number_of(p), known.try_emplace(p, number).first->second);
    }
    ASSERT_EQ(numbers.positions().size(), known.size());
    for (const auto& [p, number] : known) EXPECT_EQ(numbers.positions()[number], p);
  }
}

TEST(PositionNumbers, ZerosOfBothSignsAreOnePosition) {
  PositionNumbers<Position> numbers(1);
  EXPECT_EQ(numbers.number_of({-0.0, 1, 0.0}), 0U);
  EXPECT_EQ(numbers.number_of({0.0, 1, -0.0}), 0U);
  EXPECT_FALSE(std::signbit(numbers.positions()[0][0]));
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/chord_errors.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "tests/support/random.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr int kHalo = ChordLines::kHalo;

// All lines hold the same function of the position.
template <class Value>
std::unique_ptr<ChordLines> sampled(Value value) {
  auto lines = std::make_unique<ChordLines>();
  for (auto& axis : lines->value) {
    for (int at = 0; at < ChordLines::kSide + 2 * kHalo; ++at)
      std::fill(axis[at], axis[at] + ChordLines::kLines, value(at - kHalo));
  }
  chord_errors(*lines);
  return lines;
}
float error_from(const ChordLines& lines, int place) {
  return lines.error[1][1 + place][5];
}

TEST(ChordErrors, AParabolaIsBelowItsChordsByAnEighthOfItsBend) {
  const auto lines = sampled([](int x) { return 0.25F * static_cast<float>(x * x); });
  for (int place = -1; place < ChordLines::kSide; ++place) EXPECT_FLOAT_EQ(error_from(*lines, place), 0.5F / 8);
}

TEST(ChordErrors, ACreaseIsFoundWithItsHeightAndItsSide) {
  for (const float at : {3.25F, 3.5F, 3.9F}) {
    const auto lines = sampled([&](int x) { return -2 * std::max(static_cast<float>(x) - at, 0.0F); });
    const float part = at - 3;
    EXPECT_NEAR(error_from(*lines, 3), -2 * part * (1 - part), 1e-6) << at;
    for (const int place : {-1, 0, 1, 5, 6, 7, 8}) EXPECT_NEAR(error_from(*lines, place), 0, 1e-6) << place;
  }
}

TEST(ChordErrors, AStraightLineHasNone) {
  const auto lines = sampled([](int x) { return 2 - 0.5F * static_cast<float>(x); });
  for (int place = -1; place < ChordLines::kSide; ++place) EXPECT_EQ(error_from(*lines, place), 0);
}

TEST(ChordErrors, ACreaseMayHideWhereABendIsNotKnown) {
  const auto lines = sampled(
      [](int x) { return x > 4 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(std::max(x - 3, 0)); });
  EXPECT_FLOAT_EQ(error_from(*lines, 3), 0.5F);
  EXPECT_EQ(error_from(*lines, 6), 0);
}

TEST(ChordErrors, TheInstructionSetDoesNotMatter) {
  Random random;
  auto lines = sampled([&](int) { return static_cast<float>(random.between(-3, 3)); });
  for (auto& axis : lines->value) {
    for (auto& row : axis) {
      for (float& v : row)
        v = random.next() < 0.1 ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(random.between(-3, 3));
    }
  }
  chord_errors(*lines);
  auto other = std::make_unique<ChordLines>(*lines);
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    hwy::DisableTargets(~(targets & -targets));
    chord_errors(*other);
    hwy::DisableTargets(0);
    EXPECT_EQ(std::memcmp(lines->error, other->error, sizeof(lines->error)), 0) << hwy::TargetName(targets & -targets);
  }
}

}  // namespace
}  // namespace vps::test

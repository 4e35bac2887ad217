// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/fit_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/fine_samples.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr int kCoarse = static_cast<int>(kFieldEdge);
constexpr double kStep = 1;
constexpr double kBend = 0.4;
// Interpolation of the bent field errs upwards, by this at its worst.
constexpr double kError = kBend * 3 / 4;

// Samples of a bent field `depth` below its least value, with one limit everywhere.
struct BentField {
  FineSamples fine;
  BrickValues value{};
  BrickValues fitted{};

  BentField(double depth, double limit) {
    for (std::size_t n = 0; n < FineSamples::kCount; ++n) {
      fine.value[n] = at(depth, static_cast<int>(n), FineSamples::kEdge, kStep / 2);
      fine.limit[n] = limit;
    }
    for (std::size_t n = 0; n < value.size(); ++n) value[n] = at(depth, static_cast<int>(n), kCoarse, kStep);
    fitted = value;
  }

  static double at(double depth, int n, int edge, double step) {
    const double x = step * (n % edge);
    const double y = step * (n / edge % edge);
    const double z = step * (n / (edge * edge));
    return depth + kBend * (x * x + y * y + z * z);
  }

  bool fit(double farthest = kStep) { return fit_samples(fine, value, kStep, farthest, fitted); }

  double worst() const {
    std::array<double, FineSamples::kCount> interpolated;
    fill_between<kCoarse>(
        fitted, [](double a, double b) { return (a + b) / 2; }, interpolated);
    double worst = 0;
    for (std::size_t n = 0; n < FineSamples::kCount; ++n)
      worst = std::max(worst, std::abs(interpolated[n] - fine.value[n]));
    return worst;
  }
};

TEST(FitSamples, AnErrorToOneSideIsHalved) {
  BentField field(10, 0.55 * kError);
  EXPECT_NEAR(field.worst(), kError, 1e-12);
  EXPECT_TRUE(field.fit());
  EXPECT_LE(field.worst(), 0.55 * kError);
}

TEST(FitSamples, NothingMovesWhereAllIsGoodOrNothingIsKnown) {
  EXPECT_FALSE(BentField(10, kError * (1 + 1e-9)).fit());
  EXPECT_FALSE(BentField(10, FineSamples::kAnyError).fit());
  EXPECT_FALSE(BentField(10, FineSamples::kUnknown).fit());
}

TEST(FitSamples, SamplesNextToUnknownOnesStay) {
  BentField field(10, kError / 2);
  for (std::size_t n = 0; n < FineSamples::kCount; ++n) {
    if (n % FineSamples::kEdge > 4) field.fine.limit[n] = FineSamples::kUnknown;
  }
  EXPECT_TRUE(field.fit());
  for (std::size_t n = 0; n < field.value.size(); ++n) {
    // Samples 3 and 4 of a row lie among unknown ones, and 2 is next to one.
    if (n % kCoarse >= 2) {
      EXPECT_EQ(field.fitted[n], field.value[n]) << n;
    }
  }
}

TEST(FitSamples, SamplesNearTheSurfaceStay) {
  BentField field(0.5 * kStep, kError / 2);
  EXPECT_TRUE(field.fit());
  for (std::size_t n = 0; n < field.value.size(); ++n) {
    if (std::abs(field.value[n]) <= kStep) {
      EXPECT_EQ(field.fitted[n], field.value[n]) << n;
    }
  }
}

TEST(FitSamples, NoSampleMovesFartherThanIsAllowed) {
  constexpr double kFarthest = 0.1 * kError;
  BentField field(10, 0.01 * kError);
  EXPECT_TRUE(field.fit(kFarthest));
  double most = 0;
  for (std::size_t n = 0; n < field.value.size(); ++n)
    most = std::max(most, std::abs(field.fitted[n] - field.value[n]));
  EXPECT_NEAR(most, kFarthest, 1e-12);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace vps::test {
namespace {

TEST(Statistics, PercentileIsOneOfTheValues) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(lab::percentile(values, 0.5), 50);
  EXPECT_EQ(lab::percentile(values, 0.99), 99);
  EXPECT_EQ(lab::percentile(values, 1), 100);
  EXPECT_EQ(lab::percentile({7}, 0.99), 7);
  EXPECT_EQ(lab::percentile({7}, 0), 7);
}

TEST(Statistics, AtLeastTheAskedPartDoesNotExceedAPercentile) {
  for (int count = 1; count <= 300; ++count) {
    std::vector<double> values;
    for (int i = 1; i <= count; ++i) values.push_back(i);
    const int part = (99 * count + 99) / 100;  // rounded up
    EXPECT_EQ(lab::percentile(values, 0.99), part) << count;
  }
}

TEST(Statistics, FewerThanAHundredValuesHaveNoNinetyNinthPercentile) {
  std::vector<double> values(99, 1.0);
  EXPECT_TRUE(std::isnan(lab::spread_of(values).p99));
  EXPECT_TRUE(std::isnan(lab::times_of({values}).p99));
  EXPECT_TRUE(std::isnan(lab::times_of({values}).noise_p99));
  values.push_back(2);
  EXPECT_EQ(lab::spread_of(values).p99, 1);
  EXPECT_EQ(lab::times_of({values}).p99, 1);
  values.push_back(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(lab::spread_of(values).p99, 1);
}

TEST(Statistics, ErrorsThatWereNotToldAreCountedAndLeftOut) {
  const double errors[] = {3, std::numeric_limits<double>::quiet_NaN(), 4, 0};
  const lab::Spread s = lab::spread_of(errors);
  EXPECT_EQ(s.asked, 4U);
  EXPECT_EQ(s.told, 3U);
  EXPECT_EQ(s.max, 4);
  EXPECT_EQ(s.p50, 3);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(25.0 / 3));
  EXPECT_EQ(lab::spread_of({}).told, 0U);
}

TEST(Statistics, TimesAreMediansOfRoundsAndTheirNoiseHoldsEveryRound) {
  const lab::Times t = lab::times_of({{10, 20, 30}, {11, 19, 31}, {100, 20, 30}});
  EXPECT_EQ(t.rounds, 3U);
  EXPECT_EQ(t.p50, 20);
  EXPECT_EQ(t.max, 30);
  EXPECT_EQ(t.noise_p50, 20);   // the third round's median is 30
  EXPECT_EQ(t.noise_max, 140);  // and its largest time is 100
  const lab::Times quiet = lab::times_of({{10, 20}, {10, 20}});
  EXPECT_EQ(quiet.noise_p50, 0.5);
  EXPECT_EQ(lab::times_of({}).rounds, 0U);
}

}  // namespace
}  // namespace vps::test

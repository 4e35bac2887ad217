// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/sample_errors.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>

#include "tests/support/random.h"

namespace vps::test {

using namespace bake;
namespace {

TEST(SampleErrors, AreThoseOfOneSampleAfterTheOther) {
  constexpr double kVoxel = 0.001;
  const AllowedError allowed({0.1 * kVoxel, 2.5 * kVoxel, 3 * kVoxel, false}, kVoxel);
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    hwy::DisableTargets(~(targets & -targets));
    Random random(1);
    for (int round = 0; round < 1000; ++round) {
      // From errors that are all allowed to some that are hopeless.
      const double size = 0.3 * kVoxel * random.next();
      BrickValues exact;
      BrickValues interpolated;
      for (std::size_t n = 0; n < exact.size(); ++n) {
        exact[n] = 8 * kVoxel * (random.next() - 0.5);
        interpolated[n] = exact[n] + 2 * size * (random.next() - 0.5);
      }
      const double noted = 0.2 * kVoxel * random.next();
      SampleErrors errors;
      compare_samples(interpolated, exact, allowed, noted, errors);
      bool good = true, hopeless = false, worse = false;
      for (std::size_t n = 0; n < exact.size(); ++n) {
        const double error = std::abs(interpolated[n] - exact[n]);
        const double limit = allowed.at(exact[n]);
        EXPECT_EQ(errors.error[n], error);
        EXPECT_EQ(errors.limit[n], limit);
        EXPECT_EQ(errors.spare[n], limit - error);
        good = good && error <= limit;
        hopeless = hopeless || error > 2 * limit;
        worse = worse || error > noted;
      }
      EXPECT_EQ(errors.good, good);
      EXPECT_EQ(errors.hopeless, hopeless);
      EXPECT_EQ(errors.worse, worse);
    }
    hwy::DisableTargets(0);
  }
}

}  // namespace
}  // namespace vps::test

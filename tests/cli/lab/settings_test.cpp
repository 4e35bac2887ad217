// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/shapes.h"

namespace vps::test {
namespace {

using lab::Setting;
using lab::SweepSize;

bake::BakeOptions base_of(double voxel_size) {
  bake::BakeOptions base;
  base.voxel_size = voxel_size;
  return base;
}

TEST(Settings, EveryKnobIsTurnedAndNoNameIsGivenTwice) {
  for (const SweepSize size : {SweepSize::full, SweepSize::quick}) {
    const std::vector<Setting> settings = lab::sweep(base_of(0.001), 4, size);
    EXPECT_EQ(settings.front().knob, "base");
    std::set<std::string> names;
    std::set<std::string> knobs;
    for (const Setting& s : settings) {
      EXPECT_TRUE(names.insert(s.name).second) << s.name;
      knobs.insert(s.knob);
    }
    for (const char* knob : {"voxel", "alpha", "field", "precision", "branching", "level", "tests", "time"}) {
      const bool is_left_out =
          size == SweepSize::quick && (knob == std::string("precision") || knob == std::string("branching"));
      EXPECT_EQ(knobs.contains(knob), !is_left_out) << knob;
    }
  }
}

TEST(Settings, AllOfThemCanBeBakedForBodiesOfAnySize) {
  for (const double size : {1e-3, 0.2, 50.0, 3000.0}) {
    const TriangleMesh mesh = make_box({size, size / 2, size / 3});
    for (const Setting& s : lab::sweep(base_of(size / 40), 3, SweepSize::full)) {
      EXPECT_NO_THROW((void)bake::plan_bake(mesh, s.bake)) << s.name;
    }
  }
}

TEST(Settings, OnlyBudgetsOfTimeAreNotRepeatable) {
  for (const Setting& s : lab::sweep(base_of(0.001), 4, SweepSize::full)) {
    EXPECT_EQ(s.repeatable(), s.knob != "time") << s.name;
  }
}

}  // namespace
}  // namespace vps::test

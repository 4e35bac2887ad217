// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "cli/lab/bullet.h"

namespace vps::test {
namespace {

// A slab of 20 mm x 20 mm, rotated against the axes.
lab::Hull turned_slab(double thickness) {
  lab::Hull slab;
  for (const double u : {-0.01, 0.01}) {
    for (const double v : {-0.01, 0.01}) {
      for (const double w : {-thickness / 2, thickness / 2}) slab.push_back({0.6 * u - 0.8 * w, v, 0.8 * u + 0.6 * w});
    }
  }
  return slab;
}

std::string refusal_of(double thickness) {
  return lab::hull_refusal(lab::compound_of({turned_slab(thickness)}, {0, 0, 0}, 0));
}

TEST(HullRefusal, AThinSlabMayBeAskedAndAFlatOneMayNot) {
  EXPECT_EQ(refusal_of(0.02), "");
  EXPECT_EQ(refusal_of(1e-5), "");
  EXPECT_NE(refusal_of(1e-6).find("a hull is flat"), std::string::npos);
  EXPECT_NE(refusal_of(0).find("a hull is flat"), std::string::npos);
}

TEST(HullRefusal, OneBadHullOfACompoundIsEnough) {
  const lab::Hull whole = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
  const lab::Hull flat = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {0.01, 0.01, 0}};
  const lab::Hull triangle = {{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}};
  const auto why = [](const std::vector<lab::Hull>& hulls) {
    return lab::hull_refusal(lab::compound_of(hulls, {0, 0, 0}, 0));
  };
  EXPECT_EQ(why({whole, whole}), "");
  EXPECT_NE(why({whole, flat}), "");
  EXPECT_EQ(why({triangle}), "a hull has 3 vertices and no volume");
  EXPECT_EQ(why({}), "there is no hull");
}

}  // namespace
}  // namespace vps::test

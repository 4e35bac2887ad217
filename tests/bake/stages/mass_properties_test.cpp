// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/mass_properties.h"

#include <gtest/gtest.h>

#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

MassProperties mass_of(const TriangleMesh& mesh) {
  return mass_properties(checked(mesh));
}

TEST(MassProperties, ABoxMatchesTheFormulaAlsoFarFromTheOrigin) {
  for (const double shift : {0.0, 1000.0}) {
    const MassProperties mass = mass_of(make_box({0.5, 1, 1.5}, {shift, 2 * shift, -shift}));
    EXPECT_NEAR(mass.volume, 6, 1e-9);
    EXPECT_LT((mass.centre_of_mass - Vector(shift, 2 * shift, -shift)).norm(), 1e-9);
    EXPECT_NEAR(mass.inertia(0, 0), 6 * (4 + 9) / 12.0, 1e-9);
    EXPECT_NEAR(mass.inertia(1, 1), 6 * (1 + 9) / 12.0, 1e-9);
    EXPECT_NEAR(mass.inertia(2, 2), 6 * (1 + 4) / 12.0, 1e-9);
    EXPECT_NEAR(mass.inertia(0, 1), 0, 1e-9);
  }
}

TEST(MassProperties, ASphereMatchesTheFormula) {
  const MassProperties mass = mass_of(make_sphere(0.5, 6, {1, 2, 3}));
  const double volume = 4.0 / 3 * M_PI * 0.125;
  EXPECT_NEAR(mass.volume, volume, 1e-3 * volume);
  EXPECT_LT((mass.centre_of_mass - Vector(1, 2, 3)).norm(), 1e-9);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(mass.inertia(i, i), 0.4 * volume * 0.25, 2e-3 * volume * 0.1);
}

TEST(MassProperties, ACavityIsSubtracted) {
  const MassProperties mass = mass_of(with_cavity(make_box({1, 1, 1}), make_box({0.5, 0.5, 0.5}, {0.25, 0, 0})));
  EXPECT_NEAR(mass.volume, 8 - 1, 1e-12);
  EXPECT_NEAR(mass.centre_of_mass.x(), -0.25 / 7, 1e-12);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Open surfaces: thickened, dropped inside a solid, or refused. The volume shows whether the solid is right.
#include <gtest/gtest.h>

#include <cmath>

#include "bake/repair/self_intersections.h"
#include "tests/bake/repair/repaired.h"

namespace vps::test {
namespace {

TEST(Sheets, ASheetBecomesASolidOfItsThickness) {
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Repaired r = repaired(sheet, {Repair::automatic, 0.05, 0.2});
  EXPECT_NEAR(r.volume, 2 * 3 * 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(r.surface.bounds_min.z(), -0.1);
  EXPECT_EQ(r.outcome.notes, std::vector<std::string>{"1 open surface made 200 mm thick"});
  // A roof: its thickness is kept at the ridge.
  sheet.vertices.push_back({-2, 0, -2});
  sheet.vertices.push_back({-2, 3, -2});
  sheet.triangles.push_back({4, 0, 3});
  sheet.triangles.push_back({4, 3, 5});
  const Repaired roof = repaired(sheet, {Repair::automatic, 0.05, 0.2});
  EXPECT_NEAR(roof.volume, (2 + 2 * std::sqrt(2)) * 3 * 0.2, 0.01);
}

TEST(Sheets, ASingleTriangleAndASoupCanBeThickened) {
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  EXPECT_NEAR(repaired(one, {Repair::automatic, 0.05, 0.1}).volume, 0.05, 1e-12);
  one.vertices.insert(one.vertices.end(), {{0.2, 0.2, -0.5}, {0.2, 0.2, 0.5}, {0.9, 0.9, 0}});
  one.triangles.push_back({3, 4, 5});
  const Repaired r = repaired(one, {Repair::automatic, 0.05, 0.1});
  EXPECT_TRUE(self_intersections(r.surface).empty());
  EXPECT_LT(r.volume, 0.05 + 0.05);
  EXPECT_GT(r.volume, 0.05);
}

TEST(Sheets, AnOpenSheetInsideASolidIsDroppedAndSaid) {
  const TriangleMesh sheet = make_sheet(0.5, 0.25, {0.25, 0, 0.5});
  for (const TriangleMesh& inner : {sheet, joined(sheet, inside_out(sheet))}) {
    for (const RepairSettings& settings :
         {with(Repair::none), with(Repair::automatic), RepairSettings{{}, 0.05, 0.2}}) {
      const Repaired r = repaired(joined(make_box({1, 1, 1}), inner), settings);
      EXPECT_NEAR(r.volume, 8, 1e-12);
      EXPECT_EQ(r.outcome.used, Repair::none);
      ASSERT_FALSE(r.outcome.notes.empty());
      EXPECT_EQ(r.outcome.notes[0], "1 open surface inside a solid: dropped, as it bounds no volume");
    }
  }
  EXPECT_NEAR(repaired(joined(make_box({1, 1, 1}), sheet), with(Repair::fill)).volume, 8, 1e-12);
  const TriangleMesh two = joined(sheet, make_sheet(0.5, 0.25, {0, 0, -0.5}));
  EXPECT_EQ(repaired(joined(make_box({1, 1, 1}), two)).outcome.notes,
            std::vector<std::string>{"2 open surfaces inside a solid: dropped, as they bound no volume"});
}

TEST(Sheets, ASheetInsideIsDroppedFromACrackedSolidToo) {
  const TriangleMesh mesh = joined(shaken(make_sphere(1, 2), 0.004), make_sheet(0.25, 0.25, {0, 0, 0}));
  const Repaired r = repaired(mesh, with(Repair::automatic));
  EXPECT_EQ(r.outcome.used, Repair::stitch);
  EXPECT_NEAR(r.volume, mass_properties(checked(make_sphere(1, 2))).volume, 0.02);
}

TEST(Sheets, ASheetOutsideOrThroughASolidIsRefusedWithItsPlace) {
  const std::string outside =
      repair_refusal(joined(make_box({1, 1, 1}), make_sheet(0.3, 0.3, {5, 0, 0})), with(Repair::automatic));
  EXPECT_NE(outside.find("1 open one that bounds no volume, one outside of the closed ones at (5.1, -0.1, 0) m"),
            std::string::npos)
      << outside;
  EXPECT_NE(outside.find("--open-surface thicken="), std::string::npos) << outside;
  const std::string through =
      repair_refusal(joined(make_box({1, 1, 1}), make_sheet(3, 0.5, {0, 0, 0.5})), with(Repair::automatic));
  EXPECT_NE(through.find("that crosses or touches a closed one at ("), std::string::npos) << through;
  EXPECT_NE(through.find(", 0.5) m"), std::string::npos) << through;
  EXPECT_NE(through.find("--open-surface thicken="), std::string::npos) << through;
}

TEST(Sheets, ASheetOutsideOrThroughASolidIsThickened) {
  const RepairSettings thicken{Repair::automatic, 0.05, 0.2};
  EXPECT_NEAR(repaired(joined(make_box({1, 1, 1}), make_sheet(0.5, 0.5, {5, 0, 0})), thicken).volume, 8.2, 1e-12);
  // Two ends of 2 x 1 protrude.
  const Repaired through = repaired(joined(make_box({1, 1, 1}), make_sheet(3, 0.5, {0, 0, 0.5})), thicken);
  EXPECT_NEAR(through.volume, 8 + 2 * 2 * 1 * 0.2, 1e-12);
  EXPECT_TRUE(self_intersections(through.surface).empty());
}

TEST(Sheets, AFinOnAnEdgeOfASolidIsThickenedAloneOrRefused) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.vertices.push_back({1, -1, 3});
  mesh.vertices.push_back({1, 1, 3});
  mesh.triangles.push_back({5, 7, 9});
  mesh.triangles.push_back({5, 9, 8});
  const std::string said = repair_refusal(mesh, with(Repair::automatic));
  EXPECT_NE(said.find("crosses or touches"), std::string::npos) << said;
  // Thickening does not widen a sheet at its border: the fin stands on the box.
  const Repaired r = repaired(mesh, {Repair::automatic, 0.05, 0.2});
  EXPECT_NEAR(r.volume, 8 + 2 * 2 * 0.2, 1e-12);
}

TEST(Sheets, ASheetInACavityIsOutsideOfTheSolid) {
  const TriangleMesh hollow = with_cavity(make_box({2, 2, 2}), make_box({1, 1, 1}));
  const TriangleMesh mesh = joined(hollow, make_sheet(0.5, 0.5, {0, 0, 0}));
  EXPECT_NE(repair_refusal(mesh, with(Repair::automatic)).find("outside of the closed ones"), std::string::npos);
  EXPECT_NEAR(repaired(mesh, {Repair::automatic, 0.05, 0.2}).volume, 64 - 8 + 0.2, 1e-12);
}

TEST(Sheets, ASheetAcrossAWallThatAUnionRemovesIsInside) {
  const TriangleMesh boxes = joined(make_box({1, 1, 1}), make_box({1, 1, 1}, {1, 0.5, 0.25}));
  EXPECT_NEAR(repaired(joined(boxes, make_sheet(0.5, 0.25, {0, 0.25, 0.25}))).volume, 16 - 1 * 1.5 * 1.75, 1e-12);
}

TEST(Sheets, TheWallOfACavityWithASmallHoleIsNoSheet) {
  const TriangleMesh inner = without(make_sphere(0.5, 4), 100, 1);
  const double cavity = mass_properties(checked(make_sphere(0.5, 4))).volume;
  EXPECT_NEAR(repaired(joined(make_box({1, 1, 1}), inner), with(Repair::automatic, 0.1)).volume, 8 - cavity, 1e-3);
  // A wall with a wide hole is no sheet either, if all holes are filled.
  const TriangleMesh wide = without(make_sphere(0.5, 3), 100, 40);
  EXPECT_NEAR(repaired(joined(make_box({1, 1, 1}), wide), with(Repair::fill)).volume, 8 - cavity, 0.05);
}

}  // namespace
}  // namespace vps::test

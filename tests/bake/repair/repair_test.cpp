// SPDX-License-Identifier: GPL-3.0-or-later
// Repair of cracked, open, inside-out and overlapping meshes; sheets have a test of their own. The volume shows whether
// the solid is right.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <optional>
#include <thread>

#include "bake/repair/self_intersections.h"
#include "formats/mesh/mesh_import.h"
#include "tests/bake/repair/repaired.h"
#include "tests/support/poses.h"
#include "tests/support/shared.h"

namespace vps::test {

using namespace bake;
namespace {

TEST(Repair, NothingIsDoneToAClosedMesh) {
  const Repaired r = repaired(make_torus(1, 0.3, 24, 12));
  EXPECT_EQ(r.outcome.used, Repair::none);
  EXPECT_TRUE(r.outcome.notes.empty());
}

TEST(Repair, RoundingNoiseIsWelded) {
  const Repaired r = repaired(shaken(make_box({1, 1, 1}), 1e-7), with(Repair::automatic));
  EXPECT_EQ(r.outcome.used, Repair::weld);
  EXPECT_NEAR(r.volume, 8, 1e-5);
  EXPECT_EQ(r.surface.vertices.size(), 8U);
  EXPECT_NE(repair_refusal(shaken(make_box({1, 1, 1}), 1e-7), with(Repair::none)).find("the mesh is open"),
            std::string::npos);
}

TEST(Repair, CracksBelowAVoxelAreStitched) {
  const Repaired r = repaired(shaken(make_sphere(1, 2), 0.004), with(Repair::automatic));
  EXPECT_EQ(r.outcome.used, Repair::stitch);
  EXPECT_NEAR(r.volume, mass_properties(checked(make_sphere(1, 2))).volume, 0.02);
  EXPECT_NE(repair_refusal(shaken(make_sphere(1, 2), 0.004), with(Repair::weld)).find("the mesh is open"),
            std::string::npos);
}

TEST(Repair, CracksCloseToTheSameSurfaceForAllLargerVoxels) {
  const double right = mass_properties(checked(make_sphere(1, 3))).volume;
  const TriangleMesh soup = shaken(make_sphere(1, 3), 0.0005);
  std::optional<double> volume;
  for (const double voxels : {32, 96, 160, 400}) {
    const Repaired r = repaired(soup, with(Repair::automatic, 2 / voxels));
    EXPECT_EQ(r.outcome.used, Repair::stitch);
    ASSERT_EQ(r.outcome.notes.size(), 1U) << voxels;
    EXPECT_NE(r.outcome.notes[0].find("; smaller voxels than that may need another repair"), std::string::npos);
    EXPECT_EQ(r.volume, volume.value_or(r.volume)) << voxels;
    EXPECT_NEAR(r.volume, right, 1e-3);
    volume = r.volume;
  }
}

TEST(Repair, AVertexBesideAnOpenEdgeSplitsIt) {
  // A box whose top has a vertex in the middle of one edge. The adjacent side face lacks this vertex.
  TriangleMesh mesh = make_box({1, 1, 1});
  const auto middle = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back({0.001, -1.002, 1.001});  // near the edge 4-5
  ASSERT_EQ(mesh.triangles[2], (std::array<std::uint32_t, 3>{4, 5, 6}));
  mesh.triangles[2] = {4, middle, 6};
  mesh.triangles.push_back({middle, 5, 6});
  const Repaired r = repaired(mesh, with(Repair::automatic));
  EXPECT_EQ(r.outcome.used, Repair::stitch);
  EXPECT_NEAR(r.volume, 8, 0.01);
  EXPECT_TRUE(is_closed(r.surface));
  // Larger voxels would allow to merge it with a corner instead.
  EXPECT_EQ(repaired(mesh, with(Repair::automatic, 1.5)).volume, r.volume);
}

TEST(Repair, PinholesAreFilledNotDrawnTogether) {
  // With voxels larger than the hole its corners could be merged, which would move the surface.
  const TriangleMesh open = without(make_sphere(1, 4), 100, 1);
  const TriangleMesh whole = make_sphere(1, 4);
  for (const double voxel_size : {0.02, 0.1, 0.2}) {
    const Repaired r = repaired(open, with(Repair::automatic, voxel_size));
    EXPECT_EQ(r.outcome.used, Repair::fill) << voxel_size;
    EXPECT_EQ(r.surface.vertices.size(), whole.vertices.size()) << voxel_size;
    EXPECT_NEAR(r.volume, mass_properties(checked(whole)).volume, 1e-12) << voxel_size;
  }
  EXPECT_EQ(repaired(open, with(Repair::stitch, 0.1)).outcome.used, Repair::stitch);
}

TEST(Repair, HolesAreFilledWhereTheMeshSurroundsTheSolid) {
  const TriangleMesh wide = without(make_sphere(1, 3), 100, 40);
  const std::string said = repair_refusal(wide, with(Repair::stitch));
  EXPECT_NE(said.find("it leaks through"), std::string::npos) << said;
  const Repaired filled = repaired(wide, with(Repair::automatic));
  EXPECT_EQ(filled.outcome.used, Repair::fill);
  EXPECT_TRUE(is_closed(filled.surface));
  EXPECT_NEAR(filled.volume, mass_properties(checked(make_sphere(1, 3))).volume, 0.1);
  EXPECT_EQ(filled.surface.triangles, repaired(wide, with(Repair::fill)).surface.triangles);
  EXPECT_EQ(filled.outcome.notes, repaired(wide, with(Repair::fill)).outcome.notes);
}

TEST(Repair, WhereTwoAnswersDifferTheRefusalNamesBoth) {
  // A box without its lid is a block or a container. A long one is a bar without an end.
  const auto without_lid = [](double height) { return without(make_box({1, 1, height}), 2, 2); };
  for (const double height : {0.5, 1.0, 1.4}) {
    const std::string said = repair_refusal(without_lid(height), with(Repair::automatic));
    EXPECT_NE(said.find(fmt::format(
                  "; it is a solid of {:.3g} m^3 if the holes are filled, or hollow with thin walls; ", 8 * height)),
              std::string::npos)
        << said;
  }
  EXPECT_EQ(repaired(without_lid(10), with(Repair::automatic)).outcome.used, Repair::fill);
}

TEST(Repair, AHoleInsideAnotherSolidIsFilled) {
  // A box without its bottom stands on another: the hole lies inside of that one.
  const TriangleMesh mesh = joined(make_box({2, 2, 0.5}), without(make_box({1, 1, 1}, {0, 0, 1.25}), 0, 2));
  const Repaired r = repaired(mesh, with(Repair::automatic));
  EXPECT_EQ(r.outcome.used, Repair::fill);
  EXPECT_NEAR(r.volume, 16 + 8 - 4 * 0.25, 1e-9);
}

TEST(Repair, OnlyTinySheetsAreDroppedUnasked) {
  const TriangleMesh open = without(make_sphere(1, 3), 100, 40);
  const auto beside = [&](double half) { return joined(open, make_sheet(half, half, {3, 0, 0})); };
  EXPECT_NEAR(repaired(beside(0.05), with(Repair::automatic)).volume, repaired(open, with(Repair::fill)).volume, 1e-12);
  const std::string said = repair_refusal(beside(0.2), with(Repair::automatic));
  EXPECT_NE(said.find("; filling the holes would drop 1.3 % of the area, thickening would keep it; "),
            std::string::npos)
      << said;
}

TEST(Repair, WhatKeepsMoreIsAdvisedFirst) {
  const TriangleMesh open = without(make_sphere(1, 3), 100, 40);
  const auto thickening_is_first = [&](double half) {
    const std::string said = repair_refusal(joined(open, make_sheet(half, half, {3, 0, 0})), with(Repair::automatic));
    EXPECT_NE(said.find("--repair fill"), std::string::npos) << said;
    return said.find("--open-surface") < said.find("--repair fill");
  };
  EXPECT_TRUE(thickening_is_first(2));
  EXPECT_FALSE(thickening_is_first(0.2));
}

TEST(Repair, FillingClosesASolidBesideTrianglesThatBoundNothing) {
  // Each lone triangle is filled by its own back.
  TriangleMesh mesh = joined(without(make_box({1, 1, 1}), 0, 1), make_sheet(3, 3, {0.1, 0, 0.2}));
  for (int n = 0; n < 9; ++n) mesh = joined(mesh, without(make_sheet(0.5, 1, {0.3 * n - 1, 0.1 * n, 0.2 * n}), 0, 1));
  const Repaired r = repaired(mesh, with(Repair::fill));
  EXPECT_EQ(r.outcome.used, Repair::fill);
  EXPECT_TRUE(is_closed(r.surface));
  EXPECT_NEAR(r.volume, 8, 1e-9);
}

// A fan of `count` sheets about one line. Each has its crease across, so that its patch is off it.
TriangleMesh crossing_sheets(int count, double crease) {
  TriangleMesh all;
  for (int n = 0; n < count; ++n) {
    TriangleMesh sheet = make_sheet(1, 1, {0, 0, 0});
    sheet.vertices[0][2] += crease;
    all = joined(all, moved(turned_about_x(0.001 + std::numbers::pi * n / count), sheet));
  }
  return all;
}

TEST(Repair, FlatSheetsAreDroppedBeforeShellsAreUnited) {
  const Repaired r = repaired(joined(make_box({2, 0.2, 0.2}), crossing_sheets(20, 0)), with(Repair::fill));
  EXPECT_NEAR(r.volume, 8 * 2 * 0.2 * 0.2, 1e-9);
  ASSERT_FALSE(r.outcome.notes.empty());
  EXPECT_NE(r.outcome.notes[0].find("; dropped 20 flat sheets"), std::string::npos) << r.outcome.notes[0];
  for (const std::string& note : r.outcome.notes) EXPECT_EQ(note.find("united"), std::string::npos) << note;
  const Repaired bent = repaired(joined(make_box({2, 0.2, 0.2}), crossing_sheets(2, 0.1)), with(Repair::fill));
  EXPECT_EQ(bent.outcome.notes[0].find("flat"), std::string::npos) << bent.outcome.notes[0];
}

TEST(Repair, AUnionThatTakesMinutesIsNotTriedForAnAdvice) {
  const auto said = [](int count) { return repair_refusal(crossing_sheets(count, 0.1), with(Repair::automatic)); };
  EXPECT_NE(said(6).find("--repair fill"), std::string::npos) << said(6);
  EXPECT_EQ(said(90).find("--repair fill"), std::string::npos) << said(90);
  EXPECT_NE(said(90).find("--repair wrap"), std::string::npos) << said(90);
}

TEST(Repair, OnlyRepairsThatWorkAreAdvised) {
  const auto advised = [](const std::string& said) {
    std::vector<std::string> options;
    for (const char* option :
         {"--repair weld", "--repair stitch", "--repair fill", "--repair wrap", "--open-surface"}) {
      if (said.find(option, said.find(';')) != std::string::npos) options.emplace_back(option);
    }
    return options;
  };
  using Options = std::vector<std::string>;
  const TriangleMesh open_box = without(make_box({1, 1, 1}), 2, 2);
  const TriangleMesh sheet = make_sheet(1, 1, {0, 0, 0});
  EXPECT_EQ(advised(repair_refusal(open_box, with(Repair::automatic))),
            (Options{"--repair fill", "--repair wrap", "--open-surface"}));
  EXPECT_EQ(advised(repair_refusal(sheet, with(Repair::automatic))), (Options{"--repair wrap", "--open-surface"}));
  EXPECT_EQ(advised(repair_refusal(shaken(make_sphere(1, 2), 0.004), with(Repair::none))),
            (Options{"--repair stitch", "--repair wrap", "--open-surface"}));
  EXPECT_EQ(advised(repair_refusal(shaken(make_box({1, 1, 1}), 1e-7), with(Repair::none))),
            (Options{"--repair weld", "--repair wrap", "--open-surface"}));
}

TEST(Repair, ARefusalSaysHowWideTheHoleIs) {
  const TriangleMesh open_box = without(make_box({1, 1, 1}), 2, 2);
  const std::string wide = repair_refusal(open_box, with(Repair::automatic));
  EXPECT_NE(wide.find("up to 1.414 m wide, more than a voxel of 50 mm; "), std::string::npos) << wide;
  const std::string unknown = repair_refusal(open_box, with(Repair::automatic, 0));
  EXPECT_NE(unknown.find("up to 1.414 m wide; "), std::string::npos) << unknown;
  EXPECT_NE(unknown.find("; give --voxel or --resolution"), std::string::npos) << unknown;
}

TEST(Repair, WrapClosesWhatNothingElseDoes) {
  const TriangleMesh soup = without(shaken(make_sphere(1, 3), 0.03), 200, 20);
  const Repaired r = repaired(soup, with(Repair::wrap, 0.1));
  EXPECT_EQ(r.outcome.used, Repair::wrap);
  EXPECT_TRUE(is_closed(r.surface));
  EXPECT_NEAR(r.volume, 4.2, 0.5);
}

TEST(Repair, AnInsideOutShellAmongOthersIsRighted) {
  const TriangleMesh mesh = joined(make_box({1, 1, 1}), inside_out(make_box({1, 1, 1}, {5, 0, 0})));
  const Repaired r = repaired(mesh);
  EXPECT_NEAR(r.volume, 16, 1e-12);
  EXPECT_EQ(r.outcome.notes, std::vector<std::string>{"1 shell of 2 inside out; winding reversed"});
}

TEST(Repair, NestedShellsAreCavitiesHoweverTheyAreWound) {
  for (const bool turn : {false, true}) {
    const TriangleMesh inner = make_box({0.5, 0.5, 0.5});
    const TriangleMesh mesh = joined(make_box({1, 1, 1}), turn ? inside_out(inner) : inner);
    EXPECT_NEAR(repaired(mesh).volume, 7, 1e-12);
    // A solid inside the cavity.
    EXPECT_NEAR(repaired(joined(mesh, make_box({0.25, 0.25, 0.25}))).volume, 7.125, 1e-12);
  }
}

TEST(Repair, ABossOnTheWallOfACavityIsSolid) {
  const TriangleMesh hollow = joined(make_box({2, 2, 2}), inside_out(make_box({1, 1, 1})));
  // From 0.5 m inside the cavity to 0.5 m within the wall, or up to the wall.
  for (const double end : {1.5, 1.0}) {
    const TriangleMesh boss = make_box({(end - 0.5) / 2, 0.25, 0.25}, {(end + 0.5) / 2, 0, 0});
    const Repaired r = repaired(joined(hollow, boss));
    EXPECT_NEAR(r.volume, 64 - 8 + 0.5 * 0.5 * 0.5, 1e-12) << end;
    EXPECT_TRUE(is_closed(r.surface));
    // In one of two cavities, of which the other is wound outward.
    const TriangleMesh other = joined(make_box({2, 2, 2}, {10, 0, 0}), make_box({1, 1, 1}, {10, 0, 0}));
    EXPECT_NEAR(repaired(joined(other, joined(hollow, boss))).volume, 2 * (64 - 8) + 0.125, 1e-12) << end;
  }
}

TEST(Repair, OverlappingShellsAreUnitedExactly) {
  for (const bool turn : {false, true}) {
    const TriangleMesh second = make_box({1, 1, 1}, {1, 0.5, 0.25});
    const Repaired r = repaired(joined(make_box({1, 1, 1}), turn ? inside_out(second) : second));
    EXPECT_NEAR(r.volume, 16 - 1 * 1.5 * 1.75, 1e-12);
    EXPECT_TRUE(is_closed(r.surface));
    EXPECT_TRUE(self_intersections(r.surface).empty());
  }
}

TEST(Repair, ShellsThatTouchInAFaceBecomeOneSolidWithoutAWall) {
  // The boxes share half of a face: the coplanar case.
  const Repaired r = repaired(joined(make_box({1, 1, 1}), make_box({1, 1, 1}, {2, 1, 0})));
  EXPECT_NEAR(r.volume, 16, 1e-12);
  EXPECT_NEAR(r.surface.area, 2 * 24 - 2 * 2, 1e-12);
  EXPECT_TRUE(self_intersections(r.surface).empty());
}

// Seen along y a bow tie: one lobe of 4 / (1 + twist) m^3, one of twist^2 times as much, which is inside out.
TriangleMesh make_bow_tie(double twist) {
  TriangleMesh mesh = make_box({1, 1, 1});
  for (std::array<double, 3>& v : mesh.vertices) v[0] *= v[2] > 0 ? -twist : 1;
  return mesh;
}

TEST(Repair, APartThatIsInsideOutIsTurned) {
  for (const bool turned : {false, true}) {
    const Repaired r = repaired(turned ? inside_out(make_bow_tie(0.5)) : make_bow_tie(0.5));
    EXPECT_NEAR(r.volume, 10.0 / 3, 1e-12);
    EXPECT_TRUE(is_closed(r.surface));
    EXPECT_EQ(r.outcome.notes.back(), "a part that was inside out, at least 25 % of the rest, was turned");
  }
}

TEST(Repair, AClosedPartThatTouchesAnotherAllAroundMayBeInsideOut) {
  // Their common faces have different diagonals, so that no triangle is there twice.
  TriangleMesh second = make_box({1, 1, 1}, {2, 0, 0});
  for (std::array<double, 3>& v : second.vertices) v[1] = -v[1];
  for (const bool turned : {false, true}) {
    const Repaired r = repaired(joined(make_box({1, 1, 1}), turned ? second : inside_out(second)));
    EXPECT_NEAR(r.volume, 16, 1e-12) << turned;
    EXPECT_TRUE(self_intersections(r.surface).empty());
  }
}

TEST(Repair, ASmallPartThatIsInsideOutIsLeftOutAndNoted) {
  const Repaired r = repaired(make_bow_tie(0.05));
  EXPECT_NEAR(r.volume, 4 / 1.05, 1e-12);
  EXPECT_EQ(r.outcome.notes.back().find("a part that is inside out, at least 0.25 % of what is kept"), 0U)
      << r.outcome.notes.back();
}

TEST(Repair, CoplanarFacesOfAnOverlapStayOnce) {
  // Half of the second box is inside the first; four faces of each are coplanar.
  const Repaired r = repaired(joined(make_box({1, 1, 1}), make_box({1, 1, 1}, {1, 0, 0})));
  EXPECT_NEAR(r.volume, 12, 1e-12);
  EXPECT_NEAR(r.surface.area, 8 + 4 * 6, 1e-12);
}

TEST(Repair, TheSameSolidTwiceIsOne) {
  const Repaired r = repaired(joined(make_sphere(1, 2), make_sphere(1, 2)));
  EXPECT_NEAR(r.volume, mass_properties(checked(make_sphere(1, 2))).volume, 1e-12);
}

TEST(Repair, ASurfaceDrawnFromBothSidesIsOneSolid) {
  const Repaired r = repaired(joined(make_box({1, 1, 1}), inside_out(make_box({1, 1, 1}))));
  EXPECT_NEAR(r.volume, 8, 1e-12);
}

// Every second triangle of the cap's copy has the winding of the cap.
TEST(Repair, ACapDrawnFromBothSidesStays) {
  const TriangleMesh sphere = make_sphere(1, 3);
  const double volume = mass_properties(checked(sphere)).volume;
  for (const bool mixed : {false, true}) {
    TriangleMesh mesh = sphere;
    std::size_t copies = 0;
    for (const auto& t : sphere.triangles) {
      if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return sphere.vertices[v][2] < 0.5; })) continue;
      mesh.triangles.push_back(mixed && copies++ % 2 == 0 ? t : decltype(t){t[0], t[2], t[1]});
    }
    const Repaired r = repaired(mesh);
    EXPECT_NEAR(r.volume, volume, 1e-12) << mixed;
    EXPECT_EQ(r.surface.triangles.size(), sphere.triangles.size()) << mixed;
  }
}

TEST(Repair, AWallBetweenSolidsIsDroppedBesideACapDrawnFromBothSides) {
  TriangleMesh mesh = joined(make_box({1, 1, 1}), make_box({1, 1, 1}, {2, 0, 0}));
  const std::size_t faces = mesh.triangles.size();
  for (std::size_t i = 0; i < faces; ++i) {
    const auto t = mesh.triangles[i];
    // The sides of the first box at x = -1 and of both at z = 1, which meets the wall.
    const auto is_at = [&](std::size_t axis, double at) {
      return std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return mesh.vertices[v][axis] == at; });
    };
    if (is_at(0, -1) || is_at(2, 1)) mesh.triangles.push_back({t[0], t[2], t[1]});
  }
  const Repaired r = repaired(mesh);
  EXPECT_NEAR(r.volume, 16, 1e-12);
  EXPECT_NEAR(r.surface.area, 40, 1e-12);
}

TEST(Repair, AMobiusBandOfPatchesIsTurnedPatchByPatch) {
  // Every second triangle of a closed mesh is wound the wrong way.
  TriangleMesh mesh = make_torus(1, 0.3, 24, 12);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  EXPECT_NEAR(repaired(mesh).volume, mass_properties(checked(make_torus(1, 0.3, 24, 12))).volume, 1e-12);
}

TEST(Repair, CubesThatShareAnEdgeStayTwoSolids) {
  TriangleMesh mesh = joined(make_box({1, 1, 1}), inside_out(make_box({1, 1, 1}, {2, 2, 0})));
  EXPECT_NEAR(repaired(mesh).volume, 16, 1e-12);
}

// The lobes of an extruded figure of eight cross each other, and triangles of its caps lie on each other, after a turn
// to a rounding. @param phase  0: two vertices of the border are a rounding apart
TriangleMesh make_figure_of_eight(double phase) {
  constexpr std::uint32_t kCorners = 64;
  TriangleMesh mesh;
  for (const double z : {0.0, 0.4}) {
    for (std::uint32_t i = 0; i < kCorners; ++i) {
      const double t = 2 * std::numbers::pi * i / kCorners + phase;
      mesh.vertices.push_back({std::sin(t), std::sin(2 * t) / 2, z});
    }
  }
  for (const double z : {0.0, 0.4}) mesh.vertices.push_back({0.01, 0, z});
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const std::uint32_t k = (i + 1) % kCorners;
    mesh.triangles.insert(mesh.triangles.end(), {{i, k, k + kCorners},
                                                 {i, k + kCorners, i + kCorners},
                                                 {k, i, 2 * kCorners},
                                                 {i + kCorners, k + kCorners, 2 * kCorners + 1}});
  }
  return mesh;
}

TEST(Repair, ShellsThatCrossWhereFacesNearlyCoincideAreUnited) {
  Random random;
  for (const double phase : {0.0, 0.03}) {
    for (int i = 0; i < 5; ++i) {
      const Repaired r =
          repaired(moved(random_pose(random, 0), make_figure_of_eight(phase)), with(Repair::automatic, 0.02));
      EXPECT_NEAR(r.volume, 0.53119, 1e-5) << phase << ' ' << i;
    }
  }
}

TEST(Repair, FillingIsMeasuredAndALargeOneIsWarnedOf) {
  // One face of six.
  const TriangleMesh open = without(make_box({1, 1, 1}), 2, 2);
  const Repaired plug = repaired(open, with(Repair::fill));
  EXPECT_DOUBLE_EQ(plug.outcome.filled_share, 1.0 / 6);
  ASSERT_EQ(plug.outcome.notes.size(), 2U);
  EXPECT_EQ(plug.outcome.notes[1].find("17 % of the surface fills holes: the solid may be a plug"), 0U);
  EXPECT_EQ(plug.outcome.notes[0], "repair fill: closed 1 hole, 17 % of the surface");
  const Repaired cap = repaired(without(make_sphere(1, 3), 100, 40), with(Repair::fill));
  EXPECT_GT(cap.outcome.filled_share, 0.01);
  EXPECT_LT(cap.outcome.filled_share, 0.04);  // 40 of 1280 triangles were removed
  EXPECT_EQ(cap.outcome.notes.size(), 1U);
  EXPECT_EQ(repaired(make_box({1, 1, 1})).outcome.filled_share, 0);
}

// The volumes of these unions are not known. A closed surface without self-intersections shows that the cut is
// complete.
class RealMeshes : public testing::TestWithParam<std::string> {};

TEST_P(RealMeshes, AreClosedAndFreeOfIntersectionsAfterRepair) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/" + GetParam());
  const TriangleMesh mesh = import_mesh(path);
  RepairSettings settings;
  settings.repair = Repair::fill;
  const Extent extent = measure_extent(mesh);
  settings.voxel_size = (extent.bounds_max - extent.bounds_min).maxCoeff() / 200;
  const Repaired r = repaired(mesh, settings);
  EXPECT_TRUE(is_closed(r.surface));
  EXPECT_EQ(self_intersections(r.surface).size(), 0U);
  EXPECT_GT(r.volume, 0);
}

// Its holes have mirror images, of which CGAL chose by addresses in memory. Each thread has memory of its own.
TEST(Repair, EveryThreadFillsTheTeapotTheSame) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/teapot.obj");
  const TriangleMesh mesh = import_mesh(path);
  RepairSettings settings;
  settings.repair = Repair::fill;
  settings.voxel_size = 0.09;
  const Repaired here = repaired(mesh, settings);
  for (int n = 0; n < 3; ++n) {
    Repaired there;
    std::thread([&] { there = repaired(mesh, settings); }).join();
    EXPECT_EQ(there.surface.triangles, here.surface.triangles);
  }
}

INSTANTIATE_TEST_SUITE_P(Shared, RealMeshes,
                         testing::Values("bearing.stl", "box_10_parts.stl", "bunny_8k_nonmanifold.ply",
                                         "bunny_closed.obj", "elephant_with_holes.off", "franka_link5.dae",
                                         "ingenuity_chassis.glb", "man_selfintersect.off", "milk_truck.glb",
                                         "propeller.stl", "teapot.obj", "tetra_shared_edge.obj", "ur5_forearm.dae",
                                         "ur5_upperarm_collision.stl"),
                         [](const auto& test) { return test.param.substr(0, test.param.find('.')); });

// Counts from shared/meshes/README.md, computed by another program.
TEST(SelfIntersections, MatchTheTableOfSharedMeshes) {
  for (const auto& [name, pairs] : std::map<std::string, std::size_t>{{"bunny_8k_nonmanifold.ply", 97},
                                                                      {"bearing.stl", 21},
                                                                      {"teapot.obj", 161},
                                                                      {"man_selfintersect.off", 848},
                                                                      {"box_10_parts.stl", 4665},
                                                                      {"fandisk.off", 0},
                                                                      {"ur5_forearm.dae", 2985}}) {
    VPS_SHARED_FILE_OR_SKIP(path, "meshes/" + name);
    const TriangleMesh mesh = import_mesh(path);
    Mesh work;
    for (const auto& v : mesh.vertices) work.vertices.emplace_back(v[0], v[1], v[2]);
    work.triangles = mesh.triangles;
    std::erase_if(work.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
    EXPECT_EQ(self_intersections(work).size(), pairs) << name;
  }
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// Extreme meshes: each is refused with a reason, or its asset passes every check.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "tests/bake/scene.h"
#include "tests/bake/stages/known_solid.h"
#include "tests/support/baked.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

TriangleMesh moved(TriangleMesh mesh, const std::array<double, 9>& r, const std::array<double, 3>& by) {
  for (auto& v : mesh.vertices) {
    const auto p = v;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      v[axis] = r[3 * axis] * p[0] + r[3 * axis + 1] * p[1] + r[3 * axis + 2] * p[2] + by[axis];
    }
  }
  return mesh;
}

std::string refusal(const TriangleMesh& mesh, const BakeOptions& options) {
  try {
    (void)bake::bake(mesh, options);
  } catch (const BakeError& error) {
    return error.what();
  }
  return "";
}

constexpr std::array<double, 9> kUpright = {1, 0, 0, 0, 1, 0, 0, 0, 1};

TEST(Extremes, MillimetreVoxelsTenThousandKilometresOffAreRefused) {
  const std::string why = refusal(make_box({0.5, 0.4, 0.3}, {1e7, -1e7, 1e7}), all_fields(0.001));
  EXPECT_NE(why.find("too far for voxels of 1 mm in single precision; move it near the origin"), std::string::npos)
      << why;
  EXPECT_EQ(std::count(why.begin(), why.end(), ';'), 1) << why;
}
TEST(Extremes, VoxelsAsSmallAsTheOffsetAllowsAreRight) {
  expect_right(solid_of({Box{{0.5, 0.4, 0.3}, {7000, -7000, 7000}}}), 0.06);
  Random random;
  expect_right(solid_of(moved(make_torus(0.4, 0.15, 24, 12), random.rotation(), {-4000, 4000, 4000})), 0.04);
}

TEST(Extremes, TenMicrometres) {
  expect_right(solid_of({Box{{5e-6, 2e-6, 3e-6}, {0, 0, 0}}}), 3e-7);
  expect_right(solid_of(make_torus(3.5e-6, 1.5e-6, 24, 12)), 2e-7);
}
TEST(Extremes, TenKilometres) {
  expect_right(solid_of({Box{{5e3, 2e3, 3e3}, {0, 0, 0}}}), 300);
  expect_right(solid_of(make_torus(3.5e3, 1.5e3, 24, 12)), 200);
}

TEST(Extremes, ARodOfAspect1000) {
  Random random;
  expect_right(solid_of({Box{{0.5, 0.0005, 0.0005}, {0, 0, 0}}}), 0.0005);
  expect_right(solid_of({Box{{0.5, 0.0005, 0.0005}, {0, 0, 0}}}), 0.01);
  expect_right(solid_of(moved(make_box({0.5, 0.0005, 0.0005}), random.rotation(), {0.3, 0.2, 0.1})), 0.01);
}
TEST(Extremes, APlateOfAspect1000) {
  Random random;
  expect_right(solid_of({Box{{0.5, 0.5, 0.0005}, {0, 0, 0}}}), 0.02);
  expect_right(solid_of(moved(make_box({0.5, 0.5, 0.0005}), random.rotation(), {0.3, 0.2, 0.1})), 0.02);
}

TEST(Extremes, AThickenedTriangle) {
  TriangleMesh one;
  one.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  Solid prism;
  prism.mesh = one;
  prism.inside = [](const std::array<double, 3>& p) {
    return p[0] > 0 && p[1] > 0 && p[0] + p[1] < 1 && std::abs(p[2]) < 0.05;
  };
  prism.volume = 0.05;
  prism.area = 1 + 0.1 * (2 + std::numbers::sqrt2);
  expect_right(prism, 0.02, 0.1);
}

TEST(Extremes, AHundredBoxesApart) {
  std::vector<Box> boxes;
  Random random;
  for (int i = 0; i < 100; ++i) {
    boxes.push_back({{random.between(0.1, 0.4), random.between(0.1, 0.4), random.between(0.1, 0.4)},
                     {1.0 * (i % 5), 1.0 * (i / 5 % 5), 1.0 * (i / 25)}});
  }
  expect_right(solid_of(boxes), 0.06);
}
TEST(Extremes, AHundredBoxesInARowThatOverlapPairwise) {
  // Boxes in a straight row: four faces of each box are coplanar with its neighbours' faces.
  std::vector<Box> boxes;
  for (int i = 0; i < 100; ++i) boxes.push_back({{0.1, 0.1, 0.1}, {0.15 * i, 0, 0}});
  Solid row = solid_of(boxes);
  const Box whole{{(99 * 0.15 + 0.2) / 2, 0.1, 0.1}, {0, 0, 0}};
  row.volume = whole.volume();
  row.area = whole.area();
  expect_right(row, 0.05);
  // Staggered: only neighbours overlap.
  Random random;
  for (Box& box : boxes) {
    box.centre[1] = random.between(-0.05, 0.05);
    box.centre[2] = random.between(-0.05, 0.05);
  }
  Solid staggered = solid_of(boxes);
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    Box shared;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double gap = std::abs(boxes[i].centre[axis] - boxes[i - 1].centre[axis]);
      shared.half[axis] = boxes[i].half[axis] - gap / 2;
    }
    // The surface area of a union is the sum of both areas minus that of the intersection; likewise the volume.
    staggered.volume -= shared.volume();
    staggered.area -= shared.area();
  }
  expect_right(staggered, 0.05);
}

TriangleMesh turned(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}
TriangleMesh square(double half, double z) {
  TriangleMesh mesh;
  mesh.vertices = {{-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

TEST(Extremes, DuplicateAndOppositeFacesDoNotCount) {
  const Box box{{0.5, 0.4, 0.3}, {0, 0, 0}};
  const Solid plain = solid_of({box});
  const auto with = [&](const TriangleMesh& more) {
    Solid solid = plain;
    solid.mesh = joined(solid.mesh, more);
    return solid;
  };
  const TriangleMesh mesh = make_box(box.half);
  {
    SCOPED_TRACE("twice");
    expect_right(with(mesh), 0.05);
  }
  {
    SCOPED_TRACE("three times, once inside out");
    expect_right(with(joined(mesh, turned(mesh))), 0.05);
  }
  {
    SCOPED_TRACE("some faces twice");
    TriangleMesh some = mesh;
    some.triangles.resize(5);
    expect_right(with(some), 0.05);
  }
  // A two-sided sheet is a sheet: inside the solid it bounds no volume, through the faces it needs a thickness.
  const auto both_sides = [](double half) { return joined(square(half, 0.1), turned(square(half, 0.1))); };
  {
    SCOPED_TRACE("a sheet inside");
    expect_right(with(both_sides(0.2)), 0.05);
  }
  EXPECT_NE(refusal(with(both_sides(0.45)).mesh, all_fields(0.05)).find("--open-surface thicken="), std::string::npos);
}

// A prism whose rings have pairs of vertices `gap` apart: its sides contain triangles of aspect 1 / gap.
TriangleMesh needle_prism(double gap) {
  samples::Ring ring;
  for (int i = 0; i < 8; ++i) {
    const double angle = 2 * std::numbers::pi * i / 8 + 0.1;
    for (const double a : {angle, angle + gap}) ring.push_back({0.5 * std::cos(a), 0.5 * std::sin(a), 0});
  }
  samples::Ring top = ring;
  for (auto& p : top) p[2] = 1;
  return samples::make_skin({ring, top}, false);
}

// The distance to a needle or cap is exact up to rounding, whichever corner comes first.
TEST(Extremes, TheClosestPointOfASliverIsExact) {
  Random random;
  for (const double width : {1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-13}) {
    for (int n = 0; n < 60; ++n) {
      const double tip = n % 4 == 0 ? 1 : n % 4 == 1 ? 1 + width : random.between(0.3, 0.7);
      TriangleMesh sliver;
      sliver.vertices = {{0, 0, 0}, {1, 0, 0}, {tip, width, 0}};
      std::rotate(sliver.vertices.begin(), sliver.vertices.begin() + n % 3, sliver.vertices.end());
      sliver.triangles = {{0, 1, 2}};
      const double u = random.between(-0.1, 1.1);
      sliver.vertices.push_back({u, width * random.between(-1, 1) * u, n % 5 == 0 ? 0 : random.between(0, 0.1)});
      sliver = moved(sliver, random.rotation(), {random.next(), random.next(), random.next()});
      const auto at = [&](std::size_t i) {
        return Vector(sliver.vertices[i][0], sliver.vertices[i][1], sliver.vertices[i][2]);
      };
      const double truth = exact_distance(sliver, sliver.vertices[3], 10);
      ASSERT_NEAR((closest_on_triangle(at(3), at(0), at(1), at(2)) - at(3)).norm(), truth, 1e-11)
          << width << " trial " << n;
    }
  }
}
TEST(Extremes, NeedleTrianglesOfAspect1e6) {
  Random random;
  for (int n = 0; n < 3; ++n) {
    expect_right(solid_of(moved(needle_prism(1e-6), random.rotation(), {0.3, 0.2, 0.1})), 0.05);
  }
  expect_right(solid_of(needle_prism(1e-6)), 0.05);
}
TEST(Extremes, NeedleTrianglesOfAspect1e10) {
  Random random;
  for (int n = 0; n < 3; ++n) {
    expect_right(solid_of(moved(needle_prism(1e-10), random.rotation(), {0.3, 0.2, 0.1})), 0.05);
  }
}
// Scanlines that cross a needle triangle just beside a voxel's centre.
TEST(Extremes, ScanlinesThroughNeedlesEndAtTheRightVoxel) {
  Random random;
  for (const double gap : {1e-6, 1e-10, 1e-12}) {
    for (int trial = 0; trial < 12; ++trial) {
      const TriangleMesh mesh = moved(needle_prism(gap), random.rotation(), {0, 0, 0});
      const Surface surface = checked(mesh);
      const Oracle oracle(mesh);
      std::vector<std::size_t> needles;
      for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
        if (surface.area_normal(t).norm() < gap) needles.push_back(t);
      }
      for (const double beside : {1e-7, -1e-7, 1e-9, -1e-9}) {
        const auto pick = static_cast<std::size_t>(random.next() * static_cast<double>(needles.size()));
        const Vector p = point_on(surface, needles[pick], random) + beside * Vector::UnitX();
        Grid grid;
        grid.voxel_size = 0.1;
        grid.dims = {40, 40, 40};
        grid.brick_dims = {5, 5, 5};
        grid.origin = p - 0.1 * Vector::Constant(20.5);
        const int side = oracle.side(to_array(grid.centre(20, 20, 20)));
        if (side == 0) continue;
        ASSERT_EQ(fill_inside(surface, grid).test(grid, 20, 20, 20), side > 0) << gap << ' ' << beside;
      }
    }
  }
}

TEST(Extremes, ABodyThatIsANeedle) {
  TriangleMesh needle;
  needle.vertices = {{0, 0, 1}, {1e-6, 0, 0}, {-5e-7, 8e-7, 0}, {-5e-7, -8e-7, 0}};
  needle.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  expect_right(solid_of(needle), 0.02);
  Random random;
  expect_right(solid_of(moved(needle, random.rotation(), {0, 0, 0})), 0.02);
}
TEST(Extremes, FacesThatAreAlmostParallelToTheGrid) {
  for (const double tilt : {1e-5, 1e-9, 1e-13}) {
    const std::array<double, 9> turn = {1, -tilt, tilt, tilt, 1, -tilt, -tilt, tilt, 1};
    // The boxes measure 9, 7 and 5 voxels, and half a voxel more: faces are close to voxel planes and to voxel centres.
    expect_right(solid_of(moved(make_box({0.5625, 0.4375, 0.3125}), turn, {0, 0, 0})), 0.125);
    expect_right(solid_of(moved(make_box({0.59375, 0.46875, 0.34375}), turn, {0, 0, 0})), 0.125);
  }
}

TEST(Extremes, FacesOnVoxelPlanesAndOnVoxelCentres) {
  expect_right(solid_of({Box{{0.5, 0.75, 0.25}, {0, 0, 0}}}), 0.125);
  expect_right(solid_of({Box{{0.59375, 0.46875, 0.34375}, {0, 0, 0}}}), 0.125);
  // The small box determines the grid: all faces of the large one pass through voxel centres.
  expect_right(solid_of({Box{{0.125, 0.125, 0.125}, {-1, -1, -1}}, Box{{0.5, 0.5, 0.5}, {0.0625, 0.0625, 0.0625}}}),
               0.125);
}

TEST(Extremes, SolidsThatTouchInAFace) {
  const Box one{{0.5, 0.4, 0.3}, {0, 0, 0}};
  Solid same = solid_of({one, Box{{0.5, 0.4, 0.3}, {1, 0, 0}}});
  same.area -= 2 * 0.8 * 0.6;
  expect_right(same, 0.05);
  Solid part = solid_of({one, Box{{0.25, 0.125, 0.0625}, {0.75, 0.03125, 0.0625}}});
  part.area -= 2 * 0.25 * 0.125;
  expect_right(part, 0.05);
}
TEST(Extremes, SolidsThatTouchInAnEdge) {
  const Box one{{0.5, 0.5, 0.5}, {0, 0, 0}};
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.5}, {1, 1, 0}}}), 0.0625);
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.5}, {1, 1, 0}}}), 0.06);
  // The edge of the second box is shorter.
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.25}, {1, 1, 0.125}}}), 0.06);
}
TEST(Extremes, SolidsThatTouchInAVertex) {
  const Box one{{0.5, 0.5, 0.5}, {0, 0, 0}};
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.5}, {1, 1, 1}}}), 0.0625);
  expect_right(solid_of({one, Box{{0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}}}), 0.06);
  // A cone's tip touches the middle of a face.
  TriangleMesh cone;
  cone.vertices = {{0.5, 0, 0}, {1, 0.3, 0}, {1, -0.2, 0.25}, {1, -0.2, -0.25}};
  cone.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  const Solid tip = solid_of(turned(cone));
  ASSERT_GT(tip.volume, 0);
  Solid both = solid_of({one});
  both.mesh = joined(both.mesh, tip.mesh);
  both.volume += tip.volume;
  both.area += tip.area;
  both.inside = [one, tip](const std::array<double, 3>& p) { return one.holds(p) || tip.inside(p); };
  expect_right(both, 0.05);
}

}  // namespace
}  // namespace vps::test

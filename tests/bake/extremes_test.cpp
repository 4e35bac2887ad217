// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes at the ends of every scale: each is refused with a reason, or its asset is right in all that can be checked.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <numbers>

#include "runtime/penetration.h"
#include "tests/bake/scene.h"
#include "tests/support/baked.h"
#include "tests/support/field_samples.h"
#include "tests/support/oracle.h"
#include "tests/support/winding_number.h"

namespace vps::test {
namespace {

using Inside = std::function<bool(const std::array<double, 3>&)>;

/// A solid whose facts are known without vpsbake.
struct Solid {
  TriangleMesh mesh;
  Inside inside;  ///< of points off the surface
  double volume = 0, area = 0;
};

struct Box {
  std::array<double, 3> half, centre;
  [[nodiscard]] bool holds(const std::array<double, 3>& p) const {
    bool in = true;
    for (std::size_t axis = 0; axis < 3; ++axis) in = in && std::abs(p[axis] - centre[axis]) < half[axis];
    return in;
  }
  [[nodiscard]] double volume() const { return 8 * half[0] * half[1] * half[2]; }
  [[nodiscard]] double area() const { return 8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]); }
};

// Boxes that may touch; the caller corrects volume and area where they overlap.
Solid solid_of(const std::vector<Box>& boxes) {
  Solid solid;
  for (const Box& box : boxes) {
    solid.mesh = joined(solid.mesh, make_box(box.half, box.centre));
    solid.volume += box.volume();
    solid.area += box.area();
  }
  solid.inside = [boxes](const std::array<double, 3>& p) {
    return std::any_of(boxes.begin(), boxes.end(), [&](const Box& box) { return box.holds(p); });
  };
  return solid;
}

// A closed mesh without intersections: volume, area and inside come from its triangles.
Solid solid_of(const TriangleMesh& mesh) {
  Solid solid;
  solid.mesh = mesh;
  const auto& v = mesh.vertices;
  const Vector from(v[0][0], v[0][1], v[0][2]);
  const auto corner = [&](std::uint32_t i) { return Vector(Vector(v[i][0], v[i][1], v[i][2]) - from); };
  for (const auto& [a, b, c] : mesh.triangles) {
    solid.volume += corner(a).dot(corner(b).cross(corner(c))) / 6;
    solid.area += (corner(b) - corner(a)).cross(corner(c) - corner(a)).norm() / 2;
  }
  solid.inside = [mesh](const std::array<double, 3>& p) { return winding_number(mesh, p) > 0.5; };
  return solid;
}

TriangleMesh moved(TriangleMesh mesh, const std::array<double, 9>& r, const std::array<double, 3>& by) {
  for (auto& v : mesh.vertices) {
    const auto p = v;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      v[axis] = r[3 * axis] * p[0] + r[3 * axis + 1] * p[1] + r[3 * axis + 2] * p[2] + by[axis];
    }
  }
  return mesh;
}

/// The checks of one solid and its asset.
class Examined {
 public:
  Examined(const Solid& solid, const BakeOptions& options)
      : solid_(solid), asset_(baked(solid.mesh, options)), info_(asset_->info()) {
    RepairOutcome outcome;
    surface_ = check_mesh(solid.mesh, {options.repair, info_.voxel_size, options.sheet_thickness}, outcome);
    for (const Vector& v : surface_.vertices) boundary_.vertices.push_back(to_array(v));
    boundary_.triangles = surface_.triangles;
    distance_ = std::make_unique<SoupOracle>(boundary_);
    size_ = (surface_.bounds_max - surface_.bounds_min).maxCoeff();
    reach_ = std::max(surface_.bounds_min.cwiseAbs().maxCoeff(), surface_.bounds_max.cwiseAbs().maxCoeff());
    tolerance_ = 1e-9 * size_ + 1e-15 * reach_;
    EXPECT_EQ(asset_->voxelmap(map_, Field::real), Status::ok);
    EXPECT_EQ(asset_->pointshell(shell_), Status::ok);
  }

  void expect_facts() const {
    // Of a body of next to no volume for its size, sums in double keep fewer digits.
    const double rounding = 1e-16 * size_ * size_ * size_;
    EXPECT_NEAR(info_.volume, solid_.volume, 1e-9 * solid_.volume + rounding);
    EXPECT_NEAR(info_.surface_area, solid_.area, 1e-9 * solid_.area);
    EXPECT_EQ(asset_->verify(), Status::ok);
  }
  void expect_samples() const;
  void expect_layers() const;
  void expect_runtime_points() const;
  void expect_shell() const;
  void expect_spheres() const;
  void expect_all() const {
    expect_facts();
    expect_samples();
    expect_layers();
    expect_runtime_points();
    expect_shell();
    expect_spheres();
  }

 private:
  // The paper's V.
  [[nodiscard]] double penetration_at(const std::array<double, 3>& p) const {
    const double d = distance_->distance(p);
    return solid_.inside(p) ? d : -d;
  }
  [[nodiscard]] Vector point(std::uint32_t i) const {
    const Vec3 p = point_position(shell_, i);
    return {p.x, p.y, p.z};
  }

  const Solid& solid_;
  std::shared_ptr<Asset> asset_;
  const AssetInfo& info_;
  Surface surface_;
  TriangleMesh boundary_;
  std::unique_ptr<SoupOracle> distance_;
  double size_ = 0, reach_ = 0, tolerance_ = 0;
  VoxelmapView map_;
  PointshellView shell_;
};

// Samples are exact in the band, and on the right side wherever they are.
void Examined::expect_samples() const {
  VoxelmapView scaled;
  ASSERT_EQ(asset_->voxelmap(scaled, Field::scaled), Status::ok);
  const std::size_t stride = 1 + asset_->directory().find(SectionKind::real)->shape[0] * kFieldStride / 6000;
  std::size_t exact = 0;
  for_each_sample(map_, info_.voxel_size, [&](std::size_t at, const std::array<double, 3>& p, int level) {
    if (at % stride != 0) return;
    const double v = static_cast<const double*>(map_.values)[at];
    double truth = penetration_at(p);
    // Samples are fitted: as far from the exact value as interpolation may err.
    const double tolerance = tolerance_ + BakeOptions().field_error * info_.voxel_size;
    const double band = v > 0 ? info_.band_inner : info_.band_outer;
    // Two answers in double differ: rational arithmetic decides.
    if (std::abs(v) < band && std::abs(std::abs(v) - std::abs(truth)) > tolerance) {
      truth = std::copysign(exact_distance(boundary_, p, std::max(std::abs(truth), std::abs(v)) + tolerance), truth);
    }
    if (std::abs(v) < band) {
      ASSERT_NEAR(std::abs(v), std::abs(truth), tolerance) << p[0] << ' ' << p[1] << ' ' << p[2];
      ++exact;
    } else {
      ASSERT_GE(std::abs(truth), band - tolerance) << p[0] << ' ' << p[1] << ' ' << p[2];
    }
    if (std::abs(truth) <= tolerance_) return;
    ASSERT_EQ(v > 0, truth > 0) << p[0] << ' ' << p[1] << ' ' << p[2] << " V " << v << " truth " << truth;
    const double step = level > 0 ? 2 * info_.lambda : info_.lambda;
    ASSERT_NEAR(static_cast<const std::int8_t*>(scaled.values)[at] * step, std::clamp(v, -127 * step, 127 * step),
                0.5 * step * 1.000001);
  });
  EXPECT_GT(exact, 100U);
}

void Examined::expect_layers() const {
  VoxelmapView layers;
  ASSERT_EQ(asset_->voxelmap(layers, Field::layers), Status::ok);
  const std::size_t bricks = std::size_t{layers.brick_dims[0]} * layers.brick_dims[1] * layers.brick_dims[2];
  const std::size_t stride = 1 + asset_->directory().find(SectionKind::layers)->shape[0] * kBrickVoxels / 6000;
  for (std::size_t b = 0; b < bricks; ++b) {
    if (layers.brick_index[b] == kNoBrick) continue;
    const std::size_t base = std::size_t{layers.brick_index[b]} * kBrickVoxels;
    for (std::size_t voxel = (stride - base % stride) % stride; voxel < kBrickVoxels; voxel += stride) {
      const std::size_t index[3] = {b % layers.brick_dims[0] * kBrickEdge + voxel % 8,
                                    b / layers.brick_dims[0] % layers.brick_dims[1] * kBrickEdge + voxel / 8 % 8,
                                    b / layers.brick_dims[0] / layers.brick_dims[1] * kBrickEdge + voxel / 64};
      std::array<double, 3> p;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p[axis] = map_.origin[axis] + info_.voxel_size * (static_cast<double>(index[axis]) + 0.5);
      }
      const double truth = penetration_at(p);
      detail::Voxel found;
      found.brick = b;
      found.voxel = voxel;
      const int layer = detail::layer_of(layers, found);
      if (layer == 0) continue;
      ASSERT_EQ(layer > 0, truth > 0);
      ASSERT_GE(std::abs(truth), (std::abs(layer) - 0.5) * info_.voxel_size - tolerance_);
    }
  }
}

// Anywhere in and around the grid: the bound is one, and the sign is right where a voxel can tell.
void Examined::expect_runtime_points() const {
  Random random;
  const double s = info_.voxel_size;
  for (int n = 0; n < 3000; ++n) {
    Vec3 p;
    float* const out[3] = {&p.x, &p.y, &p.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      *out[axis] = static_cast<float>(random.between(info_.bounds_min[axis] - 12 * s, info_.bounds_max[axis] + 12 * s));
    }
    const double v = penetration(map_, p, {1, 0, 0});
    const double truth = penetration_at({p.x, p.y, p.z});
    ASSERT_GE(penetration_bound(map_, p), truth - 1e-6 * (s + std::abs(truth)) - 1.2e-7 * reach_)
        << p.x << ' ' << p.y << ' ' << p.z;
    if (std::abs(truth) > s) {
      ASSERT_EQ(v >= 0, truth >= 0) << p.x << ' ' << p.y << ' ' << p.z;
    }
  }
}

void Examined::expect_shell() const {
  // Every surface point is near a point.
  Random random;
  std::vector<double> sums;
  double sum = 0;
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) sums.push_back(sum += surface_.area_normal(t).norm());
  for (int n = 0; n < 400; ++n) {
    // Half of them by area, half by triangle: slivers have their turn.
    const auto by_area =
        static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), sum * random.next()) - sums.begin());
    const auto by_count = static_cast<std::size_t>(random.next() * static_cast<double>(sums.size()));
    const Vector p = point_on(surface_, n % 2 == 0 ? std::min(by_area, sums.size() - 1) : by_count, random);
    double nearest = 1e300;
    for (std::uint32_t i = 0; i < shell_.points; ++i) nearest = std::min(nearest, (point(i) - p).squaredNorm());
    ASSERT_LE(std::sqrt(nearest), info_.covering_radius) << p.transpose();
  }
  double area = 0;
  for (std::uint32_t i = 0; i < shell_.points; ++i) area += double{point_area(shell_, i)};
  EXPECT_NEAR(area, solid_.area, 0.001 * solid_.area);

  // A normal goes into the body: against the face that the point is on. Where faces meet at no less than a right
  // angle, it contradicts none of them by more than the differences of voxels can tell.
  const double slack = std::numbers::sqrt3 / 2 * info_.position_step + 2.4e-7 * reach_ + tolerance_;
  const std::uint32_t stride = 1 + shell_.points / 3000;
  for (std::uint32_t i = 0; i < shell_.points; i += stride) {
    const Vec3 inward = point_inward_normal(shell_, i);
    const Vector n(inward.x, inward.y, inward.z);
    ASSERT_NEAR(n.norm(), 1, 1e-6);
    std::vector<Vector> faces;
    for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
      const Vector near =
          closest_on_triangle(point(i), surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2));
      if ((near - point(i)).norm() <= slack) faces.push_back(surface_.normals[t]);
    }
    ASSERT_FALSE(faces.empty()) << "a point off the surface: " << point(i).transpose();
    double least = 1;
    double most = -1;
    bool acute = false;
    for (const Vector& f : faces) {
      least = std::min(least, f.dot(n));
      most = std::max(most, f.dot(n));
      for (const Vector& g : faces) acute = acute || f.dot(g) < -1e-3;
    }
    ASSERT_LT(least, -0.2) << point(i).transpose() << " normal " << n.transpose();
    if (!acute) {
      ASSERT_LT(most, 0.05) << point(i).transpose() << " normal " << n.transpose();
    }
  }
}

void Examined::expect_spheres() const {
  const std::uint32_t leaves = shell_.level_offsets[shell_.levels - 1];
  std::vector<std::uint32_t> first(shell_.nodes);
  std::vector<std::uint32_t> last(shell_.nodes);
  for (std::uint32_t n = shell_.nodes; n-- > 0;) {
    const std::uint32_t from = shell_.children[2 * n];
    const std::uint32_t to = from + shell_.children[2 * n + 1];
    first[n] = n >= leaves ? from : first[from];
    last[n] = n >= leaves ? to : last[to - 1];
    for (std::uint32_t i = first[n]; i < last[n]; ++i) {
      const Vec3 p = point_position(shell_, i);
      const float dx = p.x - shell_.sphere[0][n];
      const float dy = p.y - shell_.sphere[1][n];
      const float dz = p.z - shell_.sphere[2][n];
      ASSERT_LE(std::sqrt(dx * dx + dy * dy + dz * dz), shell_.sphere[3][n]) << "node " << n << " point " << i;
    }
  }
  EXPECT_EQ(first[0], 0U);
  EXPECT_EQ(last[0], shell_.points);
}

void expect_right(const Solid& solid, double voxel_size, double sheet_thickness = 0) {
  BakeOptions options = all_fields(voxel_size);
  options.sheet_thickness = sheet_thickness;
  try {
    Examined(solid, options).expect_all();
  } catch (const BakeError& error) {
    ADD_FAILURE() << error.stage << ": " << error.what();
  }
}

std::string refusal(const TriangleMesh& mesh, const BakeOptions& options) {
  try {
    (void)bake(mesh, options);
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
  // Alike in two directions: four faces of each lie in the planes of its neighbours.
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
    // The boundary of a union is that of both less that of what they share.
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
  // A sheet drawn from both sides is a sheet: it needs a thickness.
  for (const double half : {0.2, 0.45}) {
    const TriangleMesh sheet = joined(square(half, 0.1), turned(square(half, 0.1)));
    EXPECT_NE(refusal(with(sheet).mesh, all_fields(0.05)).find("use --repair fill, --repair wrap, or --open-surface"),
              std::string::npos);
  }
}

// A prism of rings with neighbours this close to each other: lateral triangles of aspect 1 / gap.
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

// A point over a needle or cap is off by no more than rounding, whichever corner comes first.
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
// Scanlines that meet a needle's face just beside a voxel's centre.
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
    // Two faces close to voxel centres, where every scanline along them is near the surface.
    expect_right(solid_of(moved(make_box({0.5625, 0.4375, 0.3125}), turn, {0, 0, 0})), 0.125);
  }
}

TEST(Extremes, FacesOnVoxelPlanesAndOnVoxelCentres) {
  expect_right(solid_of({Box{{0.5, 0.75, 0.25}, {0, 0, 0}}}), 0.125);
  expect_right(solid_of({Box{{0.5625, 0.4375, 0.3125}, {0, 0, 0}}}), 0.125);
  // The small box sets the lattice: all faces of the large one lie on voxel centres.
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
  // Not from end to end.
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.25}, {1, 1, 0.125}}}), 0.06);
}
TEST(Extremes, SolidsThatTouchInAVertex) {
  const Box one{{0.5, 0.5, 0.5}, {0, 0, 0}};
  expect_right(solid_of({one, Box{{0.5, 0.5, 0.5}, {1, 1, 1}}}), 0.0625);
  expect_right(solid_of({one, Box{{0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}}}), 0.06);
  // A tip in the middle of a face.
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

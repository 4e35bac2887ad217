// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bake/stages/known_solid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numbers>

#include "runtime/fields/penetration.h"
#include "tests/bake/scene.h"
#include "tests/support/baked.h"
#include "tests/support/field_samples.h"
#include "tests/support/oracle.h"
#include "tests/support/winding_number.h"

namespace vps::test {

using namespace bake;
namespace {

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
    // If the volume is tiny for the body's size, sums in double keep fewer digits.
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

// Samples are exact in the band within the field error, and have the right sign everywhere.
void Examined::expect_samples() const {
  VoxelmapView scaled;
  ASSERT_EQ(asset_->voxelmap(scaled, Field::scaled), Status::ok);
  const std::size_t stride = 1 + asset_->directory().find(SectionKind::real)->shape[0] * kFieldSlice / 6000;
  std::size_t exact = 0;
  for_each_sample(map_, info_.voxel_size, [&](std::size_t at, const std::array<double, 3>& p, int level) {
    if (at % stride != 0) return;
    const double v = static_cast<const double*>(map_.values)[at];
    double truth = penetration_at(p);
    // Samples are fitted: they may differ from the exact value by the allowed interpolation error.
    const double tolerance = tolerance_ + BakeOptions().field_error * info_.voxel_size;
    const double band = v > 0 ? info_.band_inner : info_.band_outer;
    // If the two results in double differ, rational arithmetic decides.
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
    if (!is_stored(layers.brick_index[b])) continue;
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

// At random points in and around the grid the bound holds. Farther than a voxel from the surface the sign is right.
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
  // Every surface point is within the covering radius of a shell point.
  Random random;
  std::vector<double> sums;
  double sum = 0;
  for (std::size_t t = 0; t < surface_.triangles.size(); ++t) sums.push_back(sum += surface_.area_normal(t).norm());
  for (int n = 0; n < 400; ++n) {
    // Half of the points are chosen by area and half by triangle, so that slivers are tested too.
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

  // A normal points into the body, against a face that the point lies on. Unless faces meet at an acute angle, it
  // points out of none of them by more than the resolution of the voxels.
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
    const auto [from, to] = children_of(shell_, n);
    first[n] = n >= leaves ? from : first[from];
    last[n] = n >= leaves ? to : last[to - 1];
    for (std::uint32_t i = first[n]; i < last[n]; ++i) {
      const Vec3 p = point_position(shell_, i);
      const Vec3 centre = sphere_centre(shell_, n);
      const float dx = p.x - centre.x;
      const float dy = p.y - centre.y;
      const float dz = p.z - centre.z;
      ASSERT_LE(std::sqrt(dx * dx + dy * dy + dz * dz), sphere_radius(shell_, n)) << "node " << n << " point " << i;
    }
  }
  EXPECT_EQ(first[0], 0U);
  EXPECT_EQ(last[0], shell_.points);
}

}  // namespace

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

void expect_right(const Solid& solid, double voxel_size, double sheet_thickness) {
  BakeOptions options = all_fields(voxel_size);
  options.sheet_thickness = sheet_thickness;
  try {
    Examined(solid, options).expect_all();
  } catch (const BakeError& error) {
    ADD_FAILURE() << error.stage << ": " << error.what();
  }
}

}  // namespace vps::test

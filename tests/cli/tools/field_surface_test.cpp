// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/field_surface.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <map>
#include <numbers>

#include "tests/support/baked.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

VoxelmapView view_of(const Asset& asset, Field field = Field::none) {
  VoxelmapView map;
  EXPECT_EQ(asset.voxelmap(map, field), Status::ok);
  return map;
}

// Number of edges that are not used equally in both directions; 0 for a closed mesh.
std::size_t open_edges(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : balance) open += count != 0 ? 1 : 0;
  return open;
}

double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    sum += p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0]) + p[2] * (q[0] * r[1] - q[1] * r[0]);
  }
  return sum / 6;
}

class FieldSurfaceOfASphere : public ::testing::TestWithParam<Field> {};

TEST_P(FieldSurfaceOfASphere, IsClosedOutwardAndWithinItsDistance) {
  constexpr double kRadius = 0.02, kVoxel = 0.001;
  const auto asset = baked(samples::make_sphere(kRadius, 5, {0.003, 0.001, -0.002}), all_fields(kVoxel));
  const VoxelmapView map = view_of(*asset, GetParam());
  const bool layers = GetParam() == Field::layers;
  for (const double step : {kVoxel / 2, kVoxel, 2.3 * kVoxel}) {
    const cli::FieldSurface surface = cli::make_field_surface(map, step);
    ASSERT_GT(surface.mesh.triangles.size(), 100U);
    EXPECT_EQ(open_edges(surface.mesh), 0U);
    // The mesh deviates from the sphere by at most step^2 / (2 R), the height of its chords, plus the field's error.
    const double within = double(map.error) + (layers ? kVoxel : 0) + step * step / (2 * kRadius);
    for (const auto& p : surface.mesh.vertices)
      ASSERT_NEAR(std::hypot(p[0] - 0.003, p[1] - 0.001, p[2] + 0.002), kRadius, within) << step;
    if (!layers) {
      EXPECT_LE(surface.residual, step * step / (2 * kRadius) + double(map.error)) << step;
      const double exact = 4.0 / 3 * std::numbers::pi * kRadius * kRadius * kRadius;
      EXPECT_NEAR(volume(surface.mesh) / exact, 1, 3 * (step * step / (2 * kRadius) + double(map.error)) / kRadius);
    } else {
      EXPECT_GT(volume(surface.mesh), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fields, FieldSurfaceOfASphere, ::testing::Values(Field::scaled, Field::real, Field::layers));

TEST(FieldSurface, OfThinAndCrowdedShapesIsClosed) {
  // Plates a voxel thick, and two spheres a third of a voxel apart: several sheets in a cell.
  constexpr double kVoxel = 0.002;
  bake::BakeOptions options = all_fields(kVoxel);
  const auto plate = baked(samples::make_box({0.02, 0.015, 0.001}), options);
  const auto spheres =
      baked(joined(samples::make_sphere(0.01, 4), samples::make_sphere(0.01, 4, {0.01186, 0.0117, 0.0118})), options);
  for (const auto& asset : {plate, spheres}) {
    for (const double step : {0.5 * kVoxel, kVoxel, 1.7 * kVoxel, 3 * kVoxel}) {
      const cli::FieldSurface surface = cli::make_field_surface(view_of(*asset), step);
      EXPECT_EQ(open_edges(surface.mesh), 0U) << step;
    }
  }
}

TEST(FieldSurface, OfACavityHasTwoSheets) {
  const auto hollow =
      baked(with_cavity(samples::make_sphere(0.02, 4), samples::make_sphere(0.01, 4)), all_fields(0.001));
  const cli::FieldSurface surface = cli::make_field_surface(view_of(*hollow), 0.001);
  EXPECT_EQ(open_edges(surface.mesh), 0U);
  const double exact = hollow->info().volume;
  EXPECT_NEAR(volume(surface.mesh) / exact, 1, 0.01);
}

// The signed distance of a box about the origin, positive outside.
double distance_to_box(const Eigen::Vector3d& p, const Eigen::Vector3d& half) {
  const Eigen::Vector3d beyond = p.cwiseAbs() - half;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

TEST(FieldSurface, OfABoxHasSharpCornersAndEdges) {
  constexpr double kVoxel = 0.0005;
  const Eigen::Vector3d half(0.012, 0.008, 0.005);
  const Eigen::Matrix3d turned = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (const Eigen::Matrix3d& turn : {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), turned}) {
    TriangleMesh box = samples::make_box({half.x(), half.y(), half.z()});
    for (auto& v : box.vertices) Eigen::Map<Eigen::Vector3d>(v.data()) = turn * Eigen::Vector3d(v[0], v[1], v[2]);
    const auto asset = baked(box, all_fields(kVoxel));
    for (const Field field : {Field::scaled, Field::real}) {
      for (const double step : {0.5 * kVoxel, kVoxel}) {
        const cli::FieldSurface surface = cli::make_field_surface(view_of(*asset, field), step);
        EXPECT_EQ(open_edges(surface.mesh), 0U);
        double corner_off = 0;
        for (const auto& corner : box.vertices) {
          double nearest = 1;
          for (const auto& p : surface.mesh.vertices)
            nearest = std::min(nearest, std::hypot(p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]));
          corner_off = std::max(corner_off, nearest);
        }
        double squares = 0;
        for (const auto& t : surface.mesh.triangles) {
          Eigen::Vector3d middle = Eigen::Vector3d::Zero();
          for (const std::uint32_t v : t)
            middle += Eigen::Map<const Eigen::Vector3d>(surface.mesh.vertices[v].data()) / 3;
          const double off = distance_to_box(turn.transpose() * middle, half);
          squares += off * off;
        }
        // The cell of a turned corner may lack the tip itself.
        EXPECT_LT(corner_off, (turn.isIdentity() ? 0.01 : 0.6) * step);
        EXPECT_LT(std::sqrt(squares / double(surface.mesh.triangles.size())), 0.022 * step);
      }
    }
  }
}

TEST(FieldSurface, TheStepForSoManyTrianglesGivesAboutThem) {
  const auto asset = baked(samples::make_sphere(0.02, 5), all_fields(0.0005));
  const cli::FieldSurface surface = cli::make_field_surface(view_of(*asset), cli::step_for(asset->info(), 10000));
  EXPECT_GT(surface.mesh.triangles.size(), 6000U);
  EXPECT_LT(surface.mesh.triangles.size(), 12000U);
  EXPECT_EQ(cli::step_for(asset->info(), 1e9), 0.0005);
}

TEST(FieldSurface, AStepFinerThanTheSamplesIsRefused) {
  const auto asset = baked(samples::make_box({0.01, 0.01, 0.01}), all_fields(0.002));
  EXPECT_THROW((void)cli::make_field_surface(view_of(*asset), 0.0004), std::invalid_argument);
  EXPECT_THROW((void)cli::make_field_surface(view_of(*asset), std::nan("")), std::invalid_argument);
}

TEST(FieldSurface, MoreCellsThanAnyoneNeedsAreRefused) {
  const auto asset = baked(make_box({0.02, 0.02, 0.02}), all_fields(0.002));
  VoxelmapView map = view_of(*asset);
  for (const float half : {20.0F, 1e4F, 1e30F}) {
    for (int axis = 0; axis < 3; ++axis) {
      map.bounds_min[axis] = -half;
      map.bounds_max[axis] = half;
    }
    EXPECT_THROW((void)cli::make_field_surface(map, 0.002), cli::FieldSurfaceError) << half;
  }
}

}  // namespace
}  // namespace vps::test

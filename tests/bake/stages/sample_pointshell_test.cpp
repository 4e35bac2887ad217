// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/sample_pointshell.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numeric>

#include "formats/quantize.h"
#include "tests/bake/scene.h"
#include "tests/support/oracle.h"

namespace vps::test {

using namespace bake;
namespace {

Pointshell sample(const Scene& scene, double alpha = std::sqrt(2.0), double thin = 1) {
  return sample_pointshell(scene.surface, find_corners(scene.surface, scene.grid.voxel_size), scene.grid, scene.voxels,
                           scene.runs, scene.field, alpha * scene.grid.voxel_size, thin);
}

double nearest(const Pointshell& shell, const Vector& p) {
  double squared = 1e300;
  for (const Vector& q : shell.positions) squared = std::min(squared, (q - p).squaredNorm());
  return std::sqrt(squared);
}

// Checks the guarantees of every pointshell.
void expect_promises(const TriangleMesh& mesh, double voxel_size) {
  const Scene scene(mesh, voxel_size);
  const Pointshell shell = sample(scene);
  const Oracle oracle(mesh);
  ASSERT_GT(shell.positions.size(), 50U);
  for (std::size_t i = 0; i < shell.positions.size(); ++i) {
    ASSERT_LT(oracle.distance(to_array(shell.positions[i])), 1e-12);
    ASSERT_NEAR(shell.inward_normals[i].norm(), 1, 1e-12);
    ASSERT_GE(shell.areas[i], 0);
  }
  const double area = std::accumulate(shell.areas.begin(), shell.areas.end(), 0.0);
  EXPECT_NEAR(area, scene.surface.area, 1e-9 * scene.surface.area);
  // Every surface point is covered: tested at random points of every triangle and at all vertices.
  Random random;
  const std::size_t per_triangle = 1 + 4000 / scene.surface.triangles.size();
  double farthest = 0;
  for (std::size_t t = 0; t < scene.surface.triangles.size(); ++t) {
    for (std::size_t n = 0; n < per_triangle; ++n) {
      farthest = std::max(farthest, nearest(shell, point_on(scene.surface, t, random)));
    }
  }
  for (const Vector& v : scene.surface.vertices) farthest = std::max(farthest, nearest(shell, v));
  EXPECT_LE(farthest, shell.covering_radius);
  EXPECT_LE(shell.covering_radius, 1.06 * shell.spacing);
  EXPECT_GE(shell.covering_radius, 0.5 * shell.spacing);
}

TEST(SamplePointshell, PromisesHoldOnASphere) {
  expect_promises(make_sphere(0.1, 3), 0.01);
}
TEST(SamplePointshell, PromisesHoldOnABoxOfLargeTriangles) {
  expect_promises(make_box({0.1, 0.07, 0.03}), 0.01);
}
TEST(SamplePointshell, PromisesHoldOnATorus) {
  expect_promises(make_torus(0.1, 0.04, 60, 30), 0.01);
}
TEST(SamplePointshell, PromisesHoldOnAPlateThinnerThanAVoxel) {
  expect_promises(make_box({0.1, 0.1, 0.002}), 0.01);
}
TEST(SamplePointshell, PromisesHoldOnANeedle) {
  TriangleMesh needle;
  needle.vertices = {{0, 0, 0.2}, {0.01, 0, 0}, {-0.005, 0.008, 0}, {-0.005, -0.008, 0}};
  needle.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  expect_promises(needle, 0.004);
}

TEST(SamplePointshell, SharpCornersArePoints) {
  const Scene scene(make_box({0.1, 0.07, 0.03}), 0.01);
  const Pointshell shell = sample(scene);
  for (const Vector& v : scene.surface.vertices) EXPECT_LT(nearest(shell, v), 1e-12);
}

TEST(SamplePointshell, PointsOnOneSideKeepTheSpacing) {
  const Scene scene(make_sphere(0.1, 4), 0.008);
  const Pointshell shell = sample(scene);
  for (std::size_t i = 0; i < shell.positions.size(); ++i) {
    for (std::size_t j = i + 1; j < shell.positions.size(); ++j) {
      ASSERT_GE((shell.positions[i] - shell.positions[j]).norm(), shell.spacing * (1 - 1e-12));
    }
  }
}

TEST(SamplePointshell, BothSidesOfAThinPlateAreSampled) {
  const Scene scene(make_box({0.1, 0.1, 0.001}), 0.01);
  const Pointshell shell = sample(scene);
  int top = 0;
  int bottom = 0;
  for (std::size_t i = 0; i < shell.positions.size(); ++i) {
    if (shell.positions[i].z() > 0.0009 && shell.inward_normals[i].z() < -0.9) ++top;
    if (shell.positions[i].z() < -0.0009 && shell.inward_normals[i].z() > 0.9) ++bottom;
  }
  EXPECT_GT(top, 100);
  EXPECT_GT(bottom, 100);
}

TEST(SamplePointshell, NormalsOfASmoothShapeAreWithinAFewDegrees) {
  const Scene scene(make_sphere(0.1, 5), 0.004);
  const Pointshell shell = sample(scene);
  double worst = 1;
  for (std::size_t i = 0; i < shell.positions.size(); ++i) {
    worst = std::min(worst, -shell.inward_normals[i].dot(shell.positions[i].normalized()));
  }
  EXPECT_GT(worst, std::cos(2 * M_PI / 180));
}

TEST(SamplePointshell, AnyNumberOfThreadsGivesTheSamePoints) {
  const Scene scene(make_torus(0.1, 0.04, 60, 30), 0.004);
  const Pointshell many = sample(scene);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Pointshell alone = sample(scene);
  EXPECT_EQ(many.positions, alone.positions);
  EXPECT_EQ(many.inward_normals, alone.inward_normals);
  EXPECT_EQ(many.areas, alone.areas);
  EXPECT_EQ(many.covering_radius, alone.covering_radius);
}

TEST(SamplePointshell, ALargerAlphaGivesFewerPoints) {
  const Scene scene(make_sphere(0.1, 4), 0.008);
  const std::size_t fine = sample(scene, 1).positions.size();
  const std::size_t coarse = sample(scene, 2).positions.size();
  EXPECT_NEAR(static_cast<double>(fine) / static_cast<double>(coarse), 4, 0.6);
}

TEST(SamplePointshell, NormalsAreThoseThatTheAssetHolds) {
  const Scene scene(make_torus(0.1, 0.04, 60, 30), 0.006);
  for (const Vector& n : sample(scene).inward_normals) {
    const auto [x, y, z] = decode_normal<double>(encode_normal(to_array(n)));
    ASSERT_LT((Vector(x, y, z) - n).norm(), 1e-15);
  }
}

TEST(SamplePointshell, NormalsOfFacesStayNearTheirFaces) {
  const auto shell_of = [](const TriangleMesh& mesh, double s) {
    const Scene scene(mesh, s);
    return sample_pointshell(scene.surface, find_corners(scene.surface, scene.grid.voxel_size), scene.grid,
                             scene.voxels, scene.runs, scene.field, 1.5 * s, 1);
  };
  const Pointshell smooth = shell_of(make_sphere(0.1, 4), 0.004);
  EXPECT_GT(smooth.normal_error_mean, 0);
  EXPECT_LT(smooth.normal_error_mean, 0.05);
  const Pointshell box = shell_of(make_box({0.1, 0.07, 0.05}), 0.004);
  EXPECT_LT(box.normal_error_mean, 0.02);
  EXPECT_LE(box.normal_error_max, M_PI / 6 + 1e-9);
  // Normals on edges and corners point between the faces' normals.
  std::size_t between = 0;
  for (const Vector& n : box.inward_normals) between += n.cwiseAbs().maxCoeff() < 0.8;
  EXPECT_GT(between, 50U);
}

// A place farther from all points than `feature_covering_radius` lies in the tangent plane of one nearby.
// @param normal_at  outward normal of the surface at a place on it
// @param bend       farthest that the surface leaves the tangent plane of an even shell's sample within its cell. [m]
template <class NormalAt>
void expect_thinned(const Scene& scene, double fewer, const NormalAt& normal_at, double bend) {
  const Pointshell even = sample(scene);
  const Pointshell thin = sample(scene, std::sqrt(2.0), 4);
  EXPECT_LT(double(thin.positions.size()), fewer * double(even.positions.size()));
  EXPECT_EQ(even.feature_covering_radius, even.covering_radius);
  EXPECT_EQ(thin.feature_covering_radius, even.covering_radius);
  EXPECT_LE(thin.covering_radius, 5.06 * thin.spacing);
  EXPECT_NEAR(std::accumulate(thin.areas.begin(), thin.areas.end(), 0.0), scene.surface.area,
              1e-9 * scene.surface.area);
  Random random;
  const std::size_t per_triangle = 1 + 4000 / scene.surface.triangles.size();
  int inside_faces = 0;
  for (std::size_t t = 0; t < scene.surface.triangles.size(); ++t) {
    for (std::size_t n = 0; n < per_triangle; ++n) {
      const Vector p = point_on(scene.surface, t, random);
      double least = 1e300;
      double off = 1e300;  // from the tangent plane of any point that is near
      for (const Vector& q : thin.positions) {
        const double distance = (q - p).norm();
        least = std::min(least, distance);
        if (distance > thin.covering_radius) continue;
        const Vector normal = normal_at(q);
        if (normal.dot(normal_at(p)) > 0.9) off = std::min(off, std::abs(normal.dot(p - q)));
      }
      ASSERT_LE(least, thin.covering_radius);
      if (least <= thin.feature_covering_radius) continue;
      ++inside_faces;
      ASSERT_LE(off, kFaceSag * scene.grid.voxel_size + bend);
    }
  }
  EXPECT_GT(inside_faces, 500);
}

TEST(SamplePointshell, FlatFacesMayHaveFewerPoints) {
  const Vector half(0.1, 0.07, 0.05);
  const Scene scene(make_box({half.x(), half.y(), half.z()}), 0.004);
  expect_thinned(
      scene, 0.4,
      [&](const Vector& p) {
        int axis = 0;
        p.cwiseAbs().cwiseQuotient(half).maxCoeff(&axis);
        return Vector(std::copysign(1.0, p[axis]) * Vector::Unit(axis));
      },
      1e-12);
  // Edges keep all their points.
  const Pointshell thin = sample(scene, std::sqrt(2.0), 4);
  for (int i = 0; i <= 200; ++i) {
    const double along = half.x() * (i / 100.0 - 1);
    EXPECT_LE(nearest(thin, {along, half.y(), half.z()}), thin.feature_covering_radius);
    EXPECT_LE(nearest(thin, {along, -half.y(), half.z()}), thin.feature_covering_radius);
  }
}

TEST(SamplePointshell, CurvedFacesKeepTheirPoints) {
  // The facets of a finely tessellated sphere are flat, but their edges are places that other bodies touch.
  const Scene scene(make_sphere(0.1, 4), 0.001);
  const std::size_t even = sample(scene).positions.size();
  EXPECT_GT(double(sample(scene, std::sqrt(2.0), 4).positions.size()), 0.9 * double(even));
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
// The bound that is proven for interpolation, against errors that a search climbs to.
#include "bake/stages/cell_bounds.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/certify.h"
#include "bake/stages/sample_field.h"
#include "bake/stages/triangle_tree.h"
#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

// A field and its exact distances. Lengths are in metres.
class SampledField {
 public:
  SampledField(const TriangleMesh& mesh, double voxel_size, double band_vx, double error_vx = 0.1)
      : scene_(mesh, voxel_size, band_vx + 1),
        inside_(scene_.surface, scene_.grid),
        triangles_(scene_.surface, (band_vx + 2) * voxel_size),
        distances_{scene_.surface, triangles_, triangles_.error() + 1e-5 * voxel_size},
        core_((band_vx - std::sqrt(0.75)) * voxel_size) {
    const FieldTolerance tolerance{error_vx * voxel_size, band_vx * voxel_size, band_vx * voxel_size, true};
    tree_ = sample_field(scene_.surface, scene_.grid, scene_.runs, scene_.field, inside_, tolerance, {.real = true});
  }

  [[nodiscard]] double bound() const { return tree_.proven; }
  [[nodiscard]] const FieldTree& tree() const { return tree_; }

  [[nodiscard]] std::vector<Vector> points_in_box(std::size_t count, std::uint64_t seed) const {
    std::vector<Vector> points(count);
    const Vector low = scene_.surface.bounds_min - Vector::Constant(core_);
    const Vector size = scene_.surface.bounds_max + Vector::Constant(core_) - low;
    for (std::size_t n = 0; n < count; ++n) {
      Random random(n + seed);
      const double x = random.next(), y = random.next(), z = random.next();
      points[n] = low + size.cwiseProduct(Vector(x, y, z));
    }
    return points;
  }

  // The largest error that is found from the worst of some points.
  [[nodiscard]] double climb(const std::vector<Vector>& points, std::size_t starts) const {
    std::vector<Place> places(points.size());
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) { places[n] = {points[n], error(points[n])}; });
    const auto end = places.begin() + static_cast<std::ptrdiff_t>(starts);
    std::partial_sort(places.begin(), end, places.end(),
                      [](const Place& a, const Place& b) { return a.error > b.error; });
    tbb::parallel_for(std::size_t{0}, starts, [&](std::size_t n) {
      Random random(n + 99);
      int failures = 0;
      for (double step = scene_.grid.voxel_size; step > 0.04 * scene_.grid.voxel_size;) {
        const double x = random.next() - 0.5, y = random.next() - 0.5, z = random.next() - 0.5;
        const Vector way(x, y, z);
        const Place other{places[n].point + step * way, error(places[n].point + step * way)};
        if (other.error > places[n].error) {
          places[n] = other;
          failures = 0;
        } else if (++failures > 25) {
          step /= 2;
          failures = 0;
        }
      }
    });
    double worst = 0;
    for (std::size_t n = 0; n < starts; ++n) worst = std::max(worst, places[n].error);
    return worst;
  }

 private:
  struct Place {
    Vector point = Vector::Zero();
    double error = 0;
  };

  // -1 where the bound does not hold.
  [[nodiscard]] double error(const Vector& p) const {
    const double distance = distances_.exact(p, triangles_.distance(p));
    if (distance > core_) return -1;
    const FieldCell cell = find_cell(scene_.grid, tree_, p);
    if (!cell.sampled) return std::numeric_limits<double>::infinity();
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) sum += cell.weights[k] * tree_.penetration[cell.samples[k]];
    return std::abs(sum - (inside_.inside(p) ? distance : -distance));
  }

  Scene scene_;
  InsideTest inside_;
  TriangleTree triangles_;
  Distances distances_;
  FieldTree tree_;
  double core_;
};

// A ring of few corners, turned by chance, or of many with bumps.
TriangleMesh turned_ring(std::uint64_t seed, double bumps = 0) {
  Random random(seed);
  const auto part = static_cast<std::uint32_t>(seed);
  const std::uint32_t more = bumps > 0 ? 4 : 1;
  TriangleMesh mesh = make_torus(0.03 + 0.02 * random.next(), 0.012, more * (5 + part % 5), more * (4 + part % 3));
  for (auto& v : mesh.vertices) {
    for (double& x : v) x += bumps * (random.next() - 0.5);
  }
  const double a = random.next() - 0.5, b = random.next() - 0.5, c = random.next() - 0.5, d = random.next() - 0.5;
  const Eigen::Matrix3d turn = Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix();
  for (auto& v : mesh.vertices) {
    const Vector p = turn * Vector(v[0], v[1], v[2]);
    v = {p.x(), p.y(), p.z()};
  }
  return mesh;
}

// Tetrahedra that are smaller than their distances.
TriangleMesh loose_tetrahedra(std::uint64_t seed, double size) {
  Random random(seed);
  TriangleMesh mesh;
  for (int n = 0; n < 64; ++n) {
    const double x = random.next(), y = random.next(), z = random.next();
    const Vector centre = 2.5 * size * (Vector(n % 4, n / 4 % 4, n / 16) + 0.4 * Vector(x, y, z));
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const Vector& way : {Vector(1, 1, 1), Vector(1, -1, -1), Vector(-1, 1, -1), Vector(-1, -1, 1)}) {
      const double a = random.next(), b = random.next(), c = random.next();
      const Vector p = centre + size / 2 * way.cwiseProduct(Vector(0.2 + a, 0.2 + b, 0.2 + c));
      mesh.vertices.push_back({p.x(), p.y(), p.z()});
    }
    for (const auto& t : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}) {
      mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return mesh;
}

TEST(CellBounds, NoErrorThatIsClimbedToExceedsTheBound) {
  for (const std::uint64_t seed : {11, 13, 25}) {
    const SampledField field(turned_ring(seed), 0.003, 2.5);
    EXPECT_LE(field.climb(field.points_in_box(40000, 1000 * seed + 7), 200), field.bound()) << seed;
    // Finest cells are within half their diagonal.
    EXPECT_LE(field.bound(), 0.2171 * 0.003) << seed;
  }
}

TEST(CellBounds, AFlatFaceHasNoError) {
  const SampledField field(make_box({0.02, 0.02, 0.02}), 0.002, 2.5);
  EXPECT_LE(field.climb(field.points_in_box(20000, 1), 100), field.bound());
}

// Cubes near a surface, with samples that err by up to 0.1 voxel: for each, places in it against its bound.
TEST(CellBounds, NoErrorInACubeExceedsItsBound) {
  constexpr double kVoxel = 0.003;
  constexpr float kCore = 1.6F;
  constexpr float kEnough = 0.4F;
  int proven = 0, tight = 0;
  for (std::uint64_t seed = 0; seed < 16; ++seed) {
    const Scene scene(seed % 4 == 3   ? loose_tetrahedra(seed, kVoxel)
                      : seed % 4 == 1 ? turned_ring(seed, 0.4 * kVoxel)
                                      : turned_ring(seed),
                      kVoxel);
    const InsideTest inside(scene.surface, scene.grid);
    const TriangleTree tree(scene.surface, 8 * kVoxel);
    const Distances distances{scene.surface, tree, tree.error() + 1e-5 * kVoxel};
    const auto signed_distance = [&](const Vector& p) {
      const double distance = distances.exact(p, tree.distance(p)) / kVoxel;
      return inside.inside(p) ? -distance : distance;
    };
    Random random(seed);
    for (int n = 0; n < 400; ++n) {
      const auto on = static_cast<std::size_t>(random.next() * static_cast<double>(scene.surface.triangles.size()));
      const double x = random.next() - 0.5, y = random.next() - 0.5, z = random.next() - 0.5;
      const Vector centre = point_on(scene.surface, on, random) + 3 * kVoxel * Vector(x, y, z);
      CellCube cube;
      cube.edge = std::ldexp(1.0F, n % 4 - 2);
      cube.low = Vector::Constant(-double(cube.edge));
      double stored[27];
      const double shift = n % 3 == 0 ? 0.1 : (n % 3 == 1 ? 0.2 : 0.6) * (random.next() - 0.5);
      for (std::size_t i = 0; i < 27; ++i) {
        const Vector at = cube.low + double(cube.edge) * Vector(int(i % 3), int(i / 3 % 3), int(i / 9));
        const double exact = signed_distance(centre + kVoxel * at);
        // Also with samples of which less is known.
        cube.exact[i] = n % 5 == 0 ? 0 : static_cast<float>(std::clamp(exact, -2.0, 2.0));
        stored[i] = exact + shift;
        cube.most_stored[i] = cube.least_stored[i] = static_cast<float>(stored[i]);
      }
      std::vector<ProofTriangle> triangles;
      std::vector<std::uint32_t> near;
      for (std::uint32_t t = 0; t < scene.surface.triangles.size(); ++t) {
        triangles.push_back(
            proof_triangle(float_triangle(scene.surface, t, centre, kVoxel, 2), scene.surface, t, centre, kVoxel));
        near.push_back(t);
      }
      const double bound = double(CellBounds(triangles, {kCore, kCore, kEnough}).bound(cube, near));
      if (bound > double(kEnough)) continue;
      ++proven;
      double worst = 0;
      Vector worst_at = Vector::Ones();
      for (int i = 0; i < 90; ++i) {
        // By chance, then near the worst place.
        const double x1 = 2 * random.next(), y1 = 2 * random.next(), z1 = 2 * random.next();
        Vector at(x1, y1, z1);
        if (i >= 50) at = (worst_at + 0.2 * (at - Vector::Ones())).cwiseMax(0).cwiseMin(1.999);
        const double u = at.x(), v = at.y(), w = at.z();
        const int c[3] = {int(u), int(v), int(w)};
        const double f[3] = {u - c[0], v - c[1], w - c[2]};
        double sum = 0;
        for (int k = 0; k < 8; ++k) {
          const int d[3] = {k & 1, k >> 1 & 1, k >> 2};
          double weight = 1;
          for (int axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? f[axis] : 1 - f[axis];
          sum += weight * stored[(c[2] + d[2]) * 9 + (c[1] + d[1]) * 3 + c[0] + d[0]];
        }
        const double truth = signed_distance(centre + kVoxel * (cube.low + double(cube.edge) * Vector(u, v, w)));
        if (std::abs(truth) > double(kCore) || std::abs(sum - truth) <= worst) continue;
        worst = std::abs(sum - truth);
        worst_at = at;
      }
      ASSERT_LE(worst, bound) << seed << ' ' << n;
      if (worst > 0.8 * bound) ++tight;
    }
  }
  EXPECT_GT(proven, 500);
  EXPECT_GT(tight, 100);
}

// The finest samples are kept even where the proof does not reach the error that was asked for.
TEST(CellBounds, HoldWhereTheFinestSamplesMissTheError) {
  for (const double error_vx : {0.01, 0.02, 0.05}) {
    for (const double voxel_size : {0.0125, 0.01, 0.007}) {
      const SampledField field(make_torus(0.035, 0.015, 40, 20), voxel_size, 2.5, error_vx);
      EXPECT_LT(field.climb(field.points_in_box(20'000, 5), 32), field.bound()) << error_vx << " vx of " << voxel_size;
    }
  }
}

TEST(CellBounds, EveryInstructionSetGivesTheSameSamples) {
  const TriangleMesh mesh = turned_ring(11);
  const SampledField all(mesh, 0.003, 2.5);
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    hwy::DisableTargets(~(targets & -targets));
    const SampledField one(mesh, 0.003, 2.5);
    hwy::DisableTargets(0);
    EXPECT_EQ(one.tree().nodes, all.tree().nodes) << hwy::TargetName(targets & -targets);
    EXPECT_EQ(one.bound(), all.bound()) << hwy::TargetName(targets & -targets);
  }
}

}  // namespace
}  // namespace vps::test

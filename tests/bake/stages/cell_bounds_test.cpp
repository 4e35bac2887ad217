// SPDX-License-Identifier: GPL-3.0-or-later
// The bound that is proven for interpolation, against errors that a search climbs to.
#include "bake/stages/cell_bounds.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/closest_point.h"
#include "bake/stages/sample_field.h"
#include "formats/mesh/mesh_import.h"
#include "tests/bake/scene.h"
#include "tests/support/shared.h"

namespace vps::test {

using namespace bake;
namespace {

// A field and its exact distances. Lengths are in metres.
class SampledField {
 public:
  SampledField(const TriangleMesh& mesh, double voxel_size, double band_vx)
      : scene_(mesh, voxel_size, band_vx + 1),
        inside_(scene_.surface, scene_.grid),
        closest_(scene_.surface),
        core_((band_vx - std::sqrt(0.75)) * voxel_size) {
    const FieldTolerance tolerance{0.1 * voxel_size, band_vx * voxel_size, band_vx * voxel_size};
    tree_ = sample_field(scene_.surface, scene_.grid, scene_.runs, scene_.field, inside_, tolerance, false);
  }

  [[nodiscard]] double bound() const { return tree_.error_bound; }
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
  [[nodiscard]] std::vector<Vector> points_near_surface(std::size_t count) const {
    std::vector<Vector> points(count);
    for (std::size_t n = 0; n < count; ++n) {
      Random random(n);
      const auto t = static_cast<std::size_t>(random.next() * static_cast<double>(scene_.surface.triangles.size()));
      const double x = random.next() - 0.5, y = random.next() - 0.5, z = random.next() - 0.5;
      points[n] = point_on(scene_.surface, t, random) + 2 * core_ * Vector(x, y, z);
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
    const double distance = closest_.distance(p);
    if (distance > core_) return -1;
    const FieldCell cell = find_cell(scene_.grid, tree_, p);
    if (cell.brick < 0) return std::numeric_limits<double>::infinity();
    double sum = 0;
    for (std::size_t k = 0; k < 8; ++k) {
      sum += cell.weights[k] * tree_.penetration[static_cast<std::size_t>(cell.brick) * kFieldStride + cell.samples[k]];
    }
    return std::abs(sum - (inside_.inside(p) ? distance : -distance));
  }

  Scene scene_;
  InsideTest inside_;
  ClosestPoint closest_;
  FieldTree tree_;
  double core_;
};

// A ring of few corners, turned by chance.
TriangleMesh turned_ring(std::uint64_t seed) {
  Random random(seed);
  const auto part = static_cast<std::uint32_t>(seed);
  TriangleMesh mesh = make_torus(0.03 + 0.02 * random.next(), 0.012, 5 + part % 5, 4 + part % 3);
  const double a = random.next() - 0.5, b = random.next() - 0.5, c = random.next() - 0.5, d = random.next() - 0.5;
  const Eigen::Matrix3d turn = Eigen::Quaterniond(a, b, c, d).normalized().toRotationMatrix();
  for (auto& v : mesh.vertices) {
    const Vector p = turn * Vector(v[0], v[1], v[2]);
    v = {p.x(), p.y(), p.z()};
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

TEST(CellBounds, SharedArmadilloWithAWideBand) {
  VPS_SHARED_FILE_OR_SKIP(path, "meshes/armadillo_52k.off");
  const TriangleMesh mesh = import_mesh(path);
  const Extent extent = measure_extent(mesh);
  const SampledField field(mesh, (extent.bounds_max - extent.bounds_min).maxCoeff() / 100, 6);
  EXPECT_LE(field.climb(field.points_near_surface(150000), 1000), field.bound());
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

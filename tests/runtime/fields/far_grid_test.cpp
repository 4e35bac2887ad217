// SPDX-License-Identifier: GPL-3.0-or-later
// Beyond the band: V, directions and contacts by the far grid.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "runtime/vps_queries.h"
#include "tests/support/baked.h"
#include "tests/support/poses.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr double kTorusRing = 0.1;    // [m]
constexpr double kTubeRadius = 0.04;  // [m]
constexpr double kTorusVoxel = 0.0025;

// A torus, whose distance is known, and a sphere's shell. The tube is 16 voxels deep.
struct TorusAndSphere {
  std::shared_ptr<Asset> torus, sphere;
  VoxelmapView map;
  PointshellView shell;
  Scratch scratch;
  std::vector<Contact> contacts;

  explicit TorusAndSphere(Field field = Field::scaled) {
    torus = shared_torus();
    sphere = shared_sphere();
    EXPECT_EQ(torus->voxelmap(map, field), Status::ok);
    EXPECT_EQ(sphere->pointshell(shell), Status::ok);
    contacts.resize(shell.points);
  }
  [[nodiscard]] double truth(Vec3 p) const {
    return kTubeRadius - std::hypot(std::hypot(double{p.x}, double{p.y}) - kTorusRing, double{p.z});
  }
  // The mesh's own error: its faces lie inside the torus.
  [[nodiscard]] double mesh_error() const { return 0.05 * kTorusVoxel; }
  QueryResult query(const Pose& pose, double distance_vx) {
    QueryOptions options;
    options.contact_distance = static_cast<float>(distance_vx * kTorusVoxel);
    QueryResult result;
    EXPECT_EQ(traverse(shell, map, pose, options, scratch, contacts, result), Status::ok);
    return result;
  }

 private:
  static std::shared_ptr<Asset> shared_torus() {
    static const auto asset = baked(make_torus(kTorusRing, kTubeRadius, 160, 80), all_fields(kTorusVoxel));
    return asset;
  }
  static std::shared_ptr<Asset> shared_sphere() {
    bake::BakeOptions options;
    options.voxel_size = 0.004;
    static const auto asset = baked(make_sphere(0.03, 4), options);
    return asset;
  }
};

// Poses from deep overlap to 20 voxels apart.
Pose pose_by_torus(Random& random) {
  Pose pose = random_pose(random, 0);
  const double turn = random.between(0, 2 * M_PI);
  const double around = random.between(0, 2 * M_PI);
  const double away = random.between(0, kTubeRadius + 0.03 + 20 * kTorusVoxel);
  pose.translation[0] = (kTorusRing + away * std::cos(around)) * std::cos(turn);
  pose.translation[1] = (kTorusRing + away * std::cos(around)) * std::sin(turn);
  pose.translation[2] = away * std::sin(around);
  return pose;
}

void expect_no_phantoms(TorusAndSphere& pair, int poses) {
  Random random(3);
  const double known = static_cast<double>(pair.map.far.range);
  std::size_t far = 0;
  for (int n = 0; n < poses; ++n) {
    const Pose pose = pose_by_torus(random);
    const double distance = random.between(0.1, 20) * kTorusVoxel;
    const QueryResult result = pair.query(pose, distance / kTorusVoxel);
    for (std::uint32_t i = 0; i < result.contacts; ++i) {
      const Contact& c = pair.contacts[i];
      const double truth = pair.truth(c.position);
      const bool in_band = std::abs(c.penetration) < 1.6 * kTorusVoxel;
      const double error = pair.mesh_error() + static_cast<double>(in_band ? pair.map.error : pair.map.far.error);
      ASSERT_GE(double{c.penetration}, -std::min(distance, known) * (1 + 1e-6));
      ASSERT_GE(truth, -std::min(distance, known) - error);
      ASSERT_NEAR(double{c.penetration}, truth, error);
      if (!in_band) ++far;
    }
  }
  EXPECT_GT(far, 100U * static_cast<std::size_t>(poses) / 10);
}

TEST(FarGrid, NoContactAtAnyDistanceIsAPhantom) {
  for (const Field field : {Field::scaled, Field::real}) {
    TorusAndSphere pair(field);
    ASSERT_NE(pair.map.far.values, nullptr);
    expect_no_phantoms(pair, field == Field::scaled ? 300 : 30);
  }
}

TEST(FarGrid, NoContactOfAHundredThousandPosesIsAPhantomSlow) {
  TorusAndSphere pair;
  expect_no_phantoms(pair, 100000);
}

TEST(FarGrid, WithoutOneNoContactLiesBeyondTheBand) {
  TorusAndSphere pair;
  pair.map.far = {};
  Random random(5);
  for (int n = 0; n < 200; ++n) {
    const QueryResult result = pair.query(pose_by_torus(random), random.between(0.1, 20));
    for (std::uint32_t i = 0; i < result.contacts; ++i) {
      ASSERT_GE(pair.truth(pair.contacts[i].position), -1.7 * kTorusVoxel);
    }
  }
}

TEST(FarGrid, TheKernelsGiveTheValuesOfPointQueries) {
  for (std::int64_t left = hwy::SupportedTargets() & HWY_TARGETS; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    TorusAndSphere pair;
    Random random(7);
    for (int n = 0; n < 60; ++n) {
      const QueryResult result = pair.query(pose_by_torus(random), 11);
      for (std::uint32_t i = 0; i < result.contacts; ++i) {
        const Contact& c = pair.contacts[i];
        // A rounded position may lie in another cell, where V jumps a little.
        ASSERT_NEAR(c.penetration, penetration(pair.map, c.position, {}), 0.15 * kTorusVoxel);
      }
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(FarGrid, DeltaOfBodiesApartIsTheirDistance) {
  TorusAndSphere pair;
  Random random(9);
  std::vector<double> off;
  for (int n = 0; n < 400; ++n) {
    const Pose pose = pose_by_torus(random);
    const QueryResult result = pair.query(pose, 0);
    const auto& [x, y, z] = pose.translation;
    const double truth = pair.truth({float(x), float(y), float(z)}) + 0.03;
    ASSERT_GE(result.delta_bound, result.delta);
    if (truth > -2 * kTorusVoxel || truth < -10 * kTorusVoxel) continue;
    off.push_back(std::abs(result.delta - truth) / kTorusVoxel);
    ASSERT_GE(result.delta_bound, truth - 0.1 * kTorusVoxel - static_cast<double>(pair.shell.covering_radius));
  }
  ASSERT_GT(off.size(), 40U);
  std::nth_element(off.begin(), off.begin() + std::ptrdiff_t(off.size() / 2), off.end());
  EXPECT_LT(off[off.size() / 2], 0.7);
}

TEST(FarGrid, DirectionsBeyondTheBandAreThoseOfTheSurface) {
  const TorusAndSphere pair;
  Random random(11);
  std::vector<double> deep, outside;
  for (int n = 0; n < 40000; ++n) {
    const Vec3 p{static_cast<float>(random.between(-0.17, 0.17)), static_cast<float>(random.between(-0.17, 0.17)),
                 static_cast<float>(random.between(-0.07, 0.07))};
    const double radial = std::hypot(double{p.x}, double{p.y});
    const double across = std::hypot(radial - kTorusRing, double{p.z});
    if (radial < 0.02 || across < 0.5 * kTorusVoxel) continue;  // ridges
    const Vec3 n_out = outward_normal(pair.map, p);
    ASSERT_NEAR(n_out.x * n_out.x + n_out.y * n_out.y + n_out.z * n_out.z, 1, 1e-4);
    const double inwards = (radial - kTorusRing) / across / radial;
    const double cosine = inwards * (double{n_out.x} * double{p.x} + double{n_out.y} * double{p.y}) +
                          double{n_out.z} * double{p.z} / across;
    const double v = (kTubeRadius - across) / kTorusVoxel;
    if (v > 5 && v < 10) deep.push_back(cosine);
    if (v < -2 && v > -10) outside.push_back(cosine);
  }
  for (std::vector<double>* cosines : {&deep, &outside}) {
    ASSERT_GT(cosines->size(), 500U);
    std::sort(cosines->begin(), cosines->end());
    EXPECT_GT((*cosines)[cosines->size() / 2], std::cos(8 * M_PI / 180));
    EXPECT_GT((*cosines)[cosines->size() / 20], std::cos(25 * M_PI / 180));
  }
}

TEST(FarGrid, ItsErrorIsWithinTheProvenBoundAlsoByClimbing) {
  const TorusAndSphere pair;
  const AssetInfo& info = pair.torus->info();
  EXPECT_GE(info.far_error.bound, info.far_error.max);
  EXPECT_GT(info.far_error.max, info.far_error.p99);
  EXPECT_GT(info.far_error.rms, 0);
  const auto error = [&](Vec3 p) {
    const double truth = pair.truth(p);
    if (truth < -info.far_range || std::abs(truth) < info.band_outer) return 0.0;
    return std::abs(static_cast<double>(penetration(pair.map, p, {})) - truth);
  };
  Random random(13);
  double worst = 0;
  for (int n = 0; n < 300; ++n) {
    Vec3 best{static_cast<float>(random.between(-0.17, 0.17)), static_cast<float>(random.between(-0.17, 0.17)),
              static_cast<float>(random.between(-0.07, 0.07))};
    double most = error(best);
    for (double step = 2 * kTorusVoxel; step > 0.02 * kTorusVoxel; step /= 2) {
      for (int way = 0; way < 6; ++way) {
        Vec3 other = best;
        float* const axes[3] = {&other.x, &other.y, &other.z};
        *axes[way / 2] += static_cast<float>(way % 2 == 0 ? step : -step);
        if (const double e = error(other); e > most) {
          most = e;
          best = other;
        }
      }
    }
    worst = std::max(worst, most);
  }
  EXPECT_LT(worst, info.far_error.bound);
  EXPECT_LT(worst, 1.3 * info.far_error.max);
  EXPECT_GT(worst, 0.3 * info.far_error.max);
}

TEST(FarGrid, IntervalsHoldTheTruth) {
  for (const Field field : {Field::layers, Field::scaled, Field::real}) {
    TorusAndSphere pair(field);
    Random random(15);
    for (int n = 0; n < 400; ++n) {
      SeparationResult result;
      const Pose pose = pose_by_torus(random);
      ASSERT_EQ(separation(pair.shell, pair.map, pose, {}, pair.scratch, result), Status::ok);
      const auto& [x, y, z] = pose.translation;
      // No point of the sphere is deeper than its point nearest to the tube's middle.
      const double deepest = std::min(pair.truth({float(x), float(y), float(z)}) + 0.03, kTubeRadius);
      ASSERT_LE(result.lower, deepest + 0.1 * kTorusVoxel);
      ASSERT_GE(result.upper, deepest - 0.3 * kTorusVoxel);
      ASSERT_GE(result.direction.x * result.direction.x + result.direction.y * result.direction.y +
                    result.direction.z * result.direction.z,
                0.9F);
    }
  }
}

}  // namespace
}  // namespace vps::test

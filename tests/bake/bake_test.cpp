// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include <tbb/global_control.h>
#include <set>

#include <cmath>
#include <cstring>

#include "bake/vps_bake.h"
#include "tests/bake/scene.h"
#include "tests/support/baked.h"
#include "tests/support/oracle.h"
#include "version.h"

namespace vps::test {

using namespace bake;
namespace {

BakeOptions all_parts(double voxel_size) {
  BakeOptions options;
  options.voxel_size = voxel_size;
  options.layers = options.scaled = options.real = true;
  return options;
}

const SectionData* find(const BakedAsset& asset, SectionKind kind) {
  for (const SectionData& section : asset.sections) {
    if (section.kind == kind) return &section;
  }
  return nullptr;
}

TEST(Bake, TheSameMeshGivesTheSameBytesForAnyNumberOfThreads) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  const BakedAsset many = bake::bake(mesh, all_parts(0.004));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const BakedAsset single = bake::bake(mesh, all_parts(0.004));
  ASSERT_EQ(many.sections.size(), single.sections.size());
  for (std::size_t i = 0; i < many.sections.size(); ++i)
    EXPECT_EQ(many.sections[i].bytes, single.sections[i].bytes) << i;
  EXPECT_EQ(many.info.scaled_error.max, single.info.scaled_error.max);
  EXPECT_EQ(many.info.covering_radius, single.info.covering_radius);
  EXPECT_EQ(many.info.position_step, single.info.position_step);
  EXPECT_EQ(many.info.area_step, single.info.area_step);
}

TEST(Bake, OnlyWhatWasAskedForIsBaked) {
  BakeOptions options;
  options.voxel_size = 0.01;
  options.pointshell = false;
  const BakedAsset map_only = bake::bake(make_sphere(0.1, 3), options);
  EXPECT_EQ(map_only.sections.size(), 6U);
  EXPECT_NE(find(map_only, SectionKind::scaled), nullptr);
  EXPECT_EQ(map_only.info.points, 0U);
  options.pointshell = true;
  options.voxelmap = false;
  const BakedAsset shell_only = bake::bake(make_sphere(0.1, 3), options);
  EXPECT_EQ(shell_only.sections.size(), 7U);
  EXPECT_EQ(shell_only.info.dims[0], 0U);
}

TEST(Bake, IntegersAreNoWiderThanTheBandNeeds) {
  BakeOptions options;
  options.voxel_size = 0.005;
  options.pointshell = false;
  const std::pair<int, ElementType> expected[] = {
      {BakeOptions::kAutoPrecision, ElementType::i8}, {3, ElementType::i8}, {5, ElementType::i16}};
  for (const auto& [precision, type] : expected) {
    options.precision = precision;
    const BakedAsset asset = bake::bake(make_sphere(0.1, 3), options);
    EXPECT_EQ(find(asset, SectionKind::scaled)->element, type) << precision;
  }
  options.precision = 8;
  EXPECT_THROW((void)bake::bake(make_sphere(0.1, 3), options), BakeError);
}

TEST(Bake, AutomaticPrecisionStepsAreAFiftiethOfAVoxelOrFiner) {
  for (const double s : {0.0005, 0.004, 0.005, 0.009, 0.01}) {
    BakeOptions options;
    options.voxel_size = s;
    options.pointshell = false;
    const AssetInfo info = bake::bake(make_sphere(0.1, 2), options).info;
    EXPECT_LE(info.lambda, s / 50 * (1 + 1e-9)) << s;
    EXPECT_GT(info.lambda, s / 51) << s;
    EXPECT_EQ(info.precision, BakeOptions::kAutoPrecision);
  }
}

TEST(Bake, TheBandMayBeWiderOnOneSide) {
  const double s = 0.005;
  const TriangleMesh mesh = make_sphere(0.1, 4);
  for (const auto& [inside, outside] : {std::pair{2.0, 6.0}, std::pair{7.0, 2.0}}) {
    const Scene scene(mesh, s, inside, outside);
    const Oracle oracle(mesh);
    std::size_t exact = 0;
    for (std::size_t brick = 0; brick < scene.field.set.bricks.size(); ++brick) {
      for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
        const double truth = oracle.penetration(to_array(scene.grid.centre(scene.field.set.bricks[brick], voxel)));
        ASSERT_NEAR(scene.field.value(brick, voxel), std::clamp(truth, -outside * s, inside * s), 1e-12);
        exact += scene.field.is_exact(brick, voxel) ? 1 : 0;
      }
    }
    // Exact values fill the band on each side, whatever the other side's width.
    const double volume = 4.0 / 3 * M_PI * (std::pow(0.1 + outside * s, 3) - std::pow(0.1 - inside * s, 3));
    EXPECT_NEAR(static_cast<double>(exact), volume / (s * s * s), 0.03 * volume / (s * s * s));
  }
}

TEST(Bake, TheCoarsestVoxelThatMeetsAnErrorIsFound) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  BakeOptions options;
  const double s = find_voxel_size(mesh, options, 0.001);
  options.pointshell = false;
  options.voxel_size = s;
  EXPECT_LE(bake::bake(mesh, options).info.scaled_error.bound, 0.001);
  options.voxel_size = 1.3 * s;
  EXPECT_GT(bake::bake(mesh, options).info.scaled_error.bound, 0.001);
  options.memory_limit_bytes = 20'000'000;
  try {
    (void)find_voxel_size(mesh, options, 1e-6);
    FAIL() << "no voxel within the limit can be that exact";
  } catch (const BakeError& error) {
    const std::string said = error.what();
    EXPECT_TRUE(said.starts_with("no voxel size reaches an error of 1 um: a grid of ")) << said;
    EXPECT_TRUE(said.ends_with("Otherwise choose a larger --max-error or a higher --memory")) << said;
  }
}

TEST(Bake, TheCertificateHoldsTheKnownErrorsOfTheFields) {
  const double s = 0.004;
  const BakedAsset asset = bake::bake(make_sphere(0.1, 5), all_parts(s));
  const AssetInfo& info = asset.info;
  EXPECT_GT(info.certificate_samples, 5000U);
  EXPECT_LE(info.real_error.max, 0.2 * s);  // twice the error that samples are placed for
  EXPECT_GT(info.real_error.max, 0.01 * s);
  EXPECT_LE(info.scaled_error.max, info.real_error.max + info.lambda * (1 + 1e-9));
  EXPECT_GT(info.layers_error.max, 0.1 * s);
  EXPECT_LT(info.layers_error.max, 1.8 * s);
  for (const FieldCertificate* c : {&info.layers_error, &info.scaled_error, &info.real_error}) {
    EXPECT_LE(c->rms, c->p99);
    EXPECT_LE(c->p99, c->max);
    const double r = std::hypot(c->worst_at[0], c->worst_at[1], c->worst_at[2]);
    EXPECT_NEAR(r, 0.1, 2.5 * s);
  }
}

TEST(Bake, MassPropertiesAndBoundsAreThoseOfTheMesh) {
  const AssetInfo info = bake::bake(make_box({0.05, 0.04, 0.03}, {0.01, 0, 0}), all_parts(0.01)).info;
  EXPECT_NEAR(info.volume, 0.1 * 0.08 * 0.06, 1e-15);
  EXPECT_NEAR(info.centre_of_mass[0], 0.01, 1e-12);
  EXPECT_DOUBLE_EQ(info.bounds_min[0], -0.04);
  EXPECT_DOUBLE_EQ(info.bounds_max[2], 0.03);
  EXPECT_EQ(info.triangles, 12U);
  EXPECT_STREQ(info.generator.data(), "vpsbake " VPSBAKE_VERSION);
}

TEST(Bake, StoredPointsStayOnTheSurfaceAndKeepItsArea) {
  const TriangleMesh mesh = make_torus(0.1, 0.04, 40, 20);
  const auto asset = baked(mesh, all_parts(0.004));
  const AssetInfo& info = asset->info();
  EXPECT_LE(info.position_step, 0.28 / 65535 * (1 + 1.0 / 128));
  PointshellView shell;
  ASSERT_EQ(asset->pointshell(shell), Status::ok);
  const Oracle oracle(mesh);
  double area = 0;
  for (std::uint32_t i = 0; i < shell.points; ++i) {
    const Vec3 p = point_position(shell, i);
    ASSERT_LE(oracle.distance({p.x, p.y, p.z}), std::sqrt(3.0) / 2 * info.position_step + 1e-8);
    const Vec3 n = point_inward_normal(shell, i);
    ASSERT_NEAR(std::sqrt(n.x * n.x + n.y * n.y + n.z * n.z), 1, 3e-7);
    area += double{point_area(shell, i)};
  }
  EXPECT_NEAR(area, info.surface_area, 0.001 * info.surface_area);
}

TEST(Bake, ProgressNamesTheStagesAndEndsAtOne) {
  BakeOptions options = all_parts(0.01);
  std::vector<std::string> stages;
  std::vector<std::string> steps;  // of the check
  std::set<std::string> names;
  double last = -1;
  options.progress = [&](const char* stage, double fraction) {
    (std::string(stage).starts_with("check: ") ? steps : stages).emplace_back(stage);
    if (!std::string(stage).starts_with("check: ")) names.insert(stage);
    EXPECT_GE(fraction, last);
    last = fraction;
  };
  const BakedAsset asset = bake::bake(make_sphere(0.1, 2), options);
  EXPECT_EQ(stages.front(), "check");
  EXPECT_EQ(stages.back(), "done");
  EXPECT_EQ(steps, (std::vector<std::string>{"check: close", "check: crossing triangles", "check: unite shells"}));
  EXPECT_EQ(last, 1);
  EXPECT_EQ(asset.times.size() + 1, names.size());
  EXPECT_GT(std::count(stages.begin(), stages.end(), "sample_field"), 4) << "a long stage reports how far it is";
}

TEST(Bake, AWallThinnerThanTwoVoxelsIsNoted) {
  const auto notes_at = [](double voxels) {
    return bake::bake(make_box({0.1, 0.1, 0.005 * voxels}), all_parts(0.01)).notes;
  };
  for (const char* const voxels : {"0.4", "1.9"}) {
    const std::vector<std::string> notes = notes_at(std::stod(voxels));
    ASSERT_EQ(notes.size(), 1U);
    EXPECT_NE(notes[0].find(std::string("the thinnest found ") + voxels + " voxels"), std::string::npos) << notes[0];
  }
  EXPECT_TRUE(notes_at(2.1).empty());
}

TEST(Bake, ResolutionCountsTheMeshWithoutWhatIsLeftOut) {
  TriangleMesh mesh = make_box({0.5, 0.5, 0.5});
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{3, 0, 0}, {3.01, 0, 0}, {3, 0.01, 0}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  BakeOptions options;
  options.resolution = 40;
  const BakedAsset asset = bake::bake(mesh, options);
  EXPECT_DOUBLE_EQ(asset.info.voxel_size, 1.0 / 40);
  EXPECT_EQ(asset.notes.back(), "without what was left out the mesh is 1 m long, not 3.51 m; voxels are 25 mm");
  options.voxel_size = 0.03;
  EXPECT_EQ(bake::bake(mesh, options).info.voxel_size, 0.03);
}

}  // namespace
}  // namespace vps::test

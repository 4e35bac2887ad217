// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/close_faces.h"

#include <gtest/gtest.h>

#include "sample_meshes/shapes.h"
#include "tests/support/baked.h"
#include "tests/support/face_jumps.h"

namespace vps::test {
namespace {

// The largest jump within a voxel of the surface. [m]
double largest_jump(const TriangleMesh& mesh, const bake::BakeOptions& options, Field field) {
  const auto asset = baked(mesh, options);
  VoxelmapView map;
  EXPECT_EQ(asset->voxelmap(map, field), Status::ok);
  double largest = 0;
  std::size_t faces = 0;
  for_each_face_jump(map, options.voxel_size, [&](double v, double jump) {
    if (std::abs(v) > options.voxel_size) return;
    largest = std::max(largest, jump);
    ++faces;
  });
  EXPECT_GT(faces, 1000U);
  return largest;
}

void expect_closed(const TriangleMesh& mesh, const bake::BakeOptions& options) {
  EXPECT_LT(largest_jump(mesh, options, Field::real), 1e-12 * options.voxel_size);
  // Rounding remains.
  const auto asset = baked(mesh, options);
  EXPECT_LT(largest_jump(mesh, options, Field::scaled), 1.001 * asset->info().lambda);
}

TEST(CloseFaces, OfACube) {
  expect_closed(make_box({0.02, 0.02, 0.02}), all_fields(0.001));
}
TEST(CloseFaces, OfANut) {
  expect_closed(samples::make_nut(), all_fields(0.0004));
}
TEST(CloseFaces, OfAThinPlateWithAWideBand) {
  bake::BakeOptions options = all_fields(0.001);
  options.band_inside = 3;
  options.band_outside = 6;
  expect_closed(make_box({0.02, 0.015, 0.0007}), options);
}
TEST(CloseFaces, WithAFineStep) {
  bake::BakeOptions options = all_fields(0.001);
  options.precision = 6;
  expect_closed(make_box({0.01, 0.02, 0.005}), options);
}

}  // namespace
}  // namespace vps::test

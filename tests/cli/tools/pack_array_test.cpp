// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/pack_array.h"

#include <gtest/gtest.h>

#include "tests/support/shapes.h"

namespace vps::test {
namespace {

TEST(PackArray, Base64IsThatOfRfc4648) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"},
                                                         {"\xff\xfe\xfd", "//79"}};
  for (const auto& [text, coded] : vectors)
    EXPECT_EQ(cli::base64(std::as_bytes(std::span(text, std::string_view(text).size()))), coded);
}

TEST(PackArray, AMeshOfFewTrianglesIsLeftAsItIs) {
  const TriangleMesh sphere = samples::make_sphere(0.02, 3);
  double cell = -1;
  const TriangleMesh same = cli::coarsened(sphere, sphere.triangles.size(), cell);
  EXPECT_EQ(cell, 0);
  EXPECT_EQ(same.vertices, sphere.vertices);
  EXPECT_EQ(same.triangles, sphere.triangles);
}

TEST(PackArray, AMeshOfManyTrianglesKeepsItsShapeWithinACell) {
  double cell = 0;
  const TriangleMesh coarse = cli::coarsened(samples::make_sphere(0.02, 6), 5000, cell);
  EXPECT_GT(cell, 0);
  EXPECT_LE(coarse.triangles.size(), 5000U);
  EXPECT_GT(coarse.triangles.size(), 1500U);
  for (const auto& p : coarse.vertices) EXPECT_NEAR(std::hypot(p[0], p[1], p[2]), 0.02, cell);
}

TEST(PackArray, PositionsAreCodesOfAFewMicrometres) {
  const auto packed = cli::pack_mesh(samples::make_box({0.1, 0.05, 0.02}, {1, 2, 3}));
  EXPECT_NEAR(packed["step"].get<double>(), 0.2 / 65535, 1e-12);
  EXPECT_NEAR(packed["origin"][1].get<double>(), 1.95, 1e-12);
  // Eight corners of three 2-byte codes, twelve triangles of three 4-byte indices, in base64.
  EXPECT_EQ(packed["positions"].get<std::string>().size(), 64U);
  EXPECT_EQ(packed["triangles"].get<std::string>().size(), 192U);
}

}  // namespace
}  // namespace vps::test

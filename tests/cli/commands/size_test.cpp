// SPDX-License-Identifier: GPL-3.0-or-later
// The size of what is baked: the grid, units and scale.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "runtime/vps_runtime.h"
#include "tests/cli/program.h"

namespace vps::test {
namespace {

TEST(Cli, WithoutASizeThereAre200VoxelsAlongTheLongestSide) {
  const TemporaryFolder folder;
  const Outcome run = vpsbake(folder, sample("peg") + " --parts voxelmap" + " -o cube.vps.hdf");
  EXPECT_EQ(run.code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  EXPECT_NE(run.out.find("note: 200 voxels along the longest side"), std::string::npos) << run.out;
  EXPECT_EQ(
      vpsbake(folder, sample("peg") + " --parts voxelmap" + " --resolution 200 -o same.vps.hdf").out.find("note: 200"),
      std::string::npos);
  EXPECT_EQ(read_file(folder / "cube.vps.hdf"), read_file(folder / "same.vps.hdf"));
  EXPECT_EQ(vpsbake(folder, "check " + sample("peg")).code, 0);
}

// A box of this length, as text STL.
std::string box_stl(double length) {
  std::string text = "solid box\n";
  const auto corner = [&](unsigned i) {
    return "vertex " + std::to_string(i & 1U ? length : 0) + " " + std::to_string(i & 2U ? 0.5 * length : 0) + " " +
           std::to_string(i & 4U ? 0.5 * length : 0) + "\n";
  };
  constexpr unsigned kFaces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& face : kFaces) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const unsigned i : face) text += corner(i);
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid box\n";
}

TEST(Cli, AnUnlikelyUnitIsOneWarningUnlessItIsGiven) {
  const TemporaryFolder folder;
  write_file(folder / "nut.stl", box_stl(6.35));
  write_file(folder / "link.stl", box_stl(0.545));
  const std::string warning = "its numbers are likely mm, but were read as metres; add --unit mm, or --unit m";
  const auto warnings = [&](const std::string& arguments) {
    const Outcome run = vpsbake(folder, arguments + " --resolution 20");
    EXPECT_EQ(run.code, 0) << run.err;
    return run.err;
  };
  EXPECT_NE(warnings("nut.stl").find("vpsbake: warning: nut.stl: " + warning), std::string::npos);
  for (const char* good : {"nut.stl --unit mm", "nut.stl --unit m", "nut.stl --scale 0.001", "link.stl"})
    EXPECT_EQ(warnings(good), "") << good;
  EXPECT_EQ(warnings(sample("gear") + " --scale 1 -o gear.vps.hdf"), "");
  EXPECT_NE(warnings("nut.stl --dry-run").find(warning), std::string::npos);
  write_file(folder / "open.stl",
             "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\n"
             "endfacet\nendsolid one\n");
  write_file(folder / "point.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n");
  expect_refusal(folder, "point.obj --resolution 20", 3, "all vertices of the mesh are one point");
  expect_refusal(folder, "open.stl --resolution 20", 3, "; its numbers are likely mm: then add --unit mm\n");
  EXPECT_EQ(vpsbake(folder, "open.stl --resolution 20 --unit m").err.find("likely"), std::string::npos);
  const Outcome check = vpsbake(folder, "check nut.stl");
  EXPECT_NE(check.out.find("likely mm, add --unit mm"), std::string::npos) << check.out;
  write_file(folder / "vpsbake.toml", "resolution = 20\n");
  std::filesystem::copy_file(folder / "nut.stl", folder / "other.stl");
  const Outcome batch = vpsbake(folder, "batch nut.stl other.stl -o out");
  const std::string line = ".stl: " + warning + " to keep them\n";
  EXPECT_TRUE(batch.err == "vpsbake: warning: ./nut" + line || batch.err == "vpsbake: warning: ./other" + line)
      << "once for all: " << batch.err;
  EXPECT_NE(vpsbake(folder, "batch nut.stl -o out2 --json").out.find(warning), std::string::npos);
  write_file(folder / "vpsbake.toml", "resolution = 20\nunit = \"mm\"\n");
  EXPECT_EQ(vpsbake(folder, "batch nut.stl other.stl -o out").err, "");
}

TEST(Cli, AnImplausibleSizeIsOneNote) {
  const TemporaryFolder folder;
  write_file(folder / "box.stl", box_stl(0.2));
  write_file(folder / "big.stl", box_stl(2));
  const auto said = [&](const std::string& arguments) {
    const Outcome run = vpsbake(folder, arguments + " --resolution 20");
    EXPECT_EQ(run.code, 0) << run.err;
    return run.err;
  };
  EXPECT_EQ(said("box.stl --unit mm"),
            "vpsbake: note: box.stl: it is 200 um x 100 um x 100 um large; check --unit, which says what its numbers "
            "mean\n");
  EXPECT_NE(said("big.stl --scale 1000").find("it is 2 km x 1 km x 1 km large; check --unit"), std::string::npos);
  for (const char* without :
       {"big.stl --unit mm", "big.stl --unit m", "big.stl --scale 0.0005", "box.stl", "box.stl --unit mm -q"})
    EXPECT_EQ(said(without), "") << without;
  const Outcome batch = vpsbake(folder, "batch box.stl big.stl --unit mm --resolution 20 -o out");
  EXPECT_EQ(batch.code, 0) << batch.err;
  EXPECT_NE(batch.out.find("box.vps.hdf"), std::string::npos) << batch.out;
  const std::size_t note = batch.out.find("note: it is 200 um x 100 um x 100 um large; check --unit");
  EXPECT_NE(note, std::string::npos) << batch.out;
  EXPECT_EQ(batch.out.find("large; check", note + 60), std::string::npos) << "not of big.stl: " << batch.out;
}

TEST(Cli, UnitScaleAndResolutionGiveTheSizeThatIsMeant) {
  const TemporaryFolder folder;
  const std::string mesh = sample("cube");  // 0.1 units wide
  const auto size_of = [&](const std::string& options) {
    const Outcome run = vpsbake(folder, mesh + " -o a.vps.hdf --json " + options);
    EXPECT_EQ(run.code, 0) << run.err;
    const auto j = nlohmann::json::parse(run.out);
    return std::pair(j["mesh"]["bounds_max"][0].get<double>() - j["mesh"]["bounds_min"][0].get<double>(),
                     j["voxel_size"].get<double>());
  };
  const auto expect_near = [](std::pair<double, double> got, double size, double voxel) {
    EXPECT_NEAR(got.first, size, 1e-6 * size);
    EXPECT_NEAR(got.second, voxel, 1e-6 * voxel);
  };
  expect_near(size_of("--voxel 0.01m"), 0.1, 0.01);
  expect_near(size_of("--voxel 0.05mm --unit cm"), 0.001, 0.00005);
  expect_near(size_of("--voxel 10um --unit mm"), 0.0001, 0.00001);
  expect_near(size_of("--voxel '0.01 in' --unit in"), 0.00254, 0.000254);
  expect_near(size_of("--resolution 20 --scale 10"), 1, 0.05);
}

}  // namespace
}  // namespace vps::test

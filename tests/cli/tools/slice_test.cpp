// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the pictures of `vpsbake slice` with the baked shapes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <sstream>

#include "cli/tools/slice/picture.h"
#include "tests/cli/program.h"
#include "tests/support/image.h"
#include "tests/support/shapes.h"

namespace vps::test {
namespace {

constexpr std::array<int, 3> kBlack = {0, 0, 0};

// The plot within its frame, which is the first dark line from the left and from above.
struct Plot {
  Image image;
  std::string out, err;  // of the program
  std::size_t left = 0, top = 0, right = 0, bottom = 0;
  double pixel = 0;  // [m]

  [[nodiscard]] std::array<int, 3> centre() const { return image.at((left + right) / 2, (top + bottom) / 2); }
};

constexpr std::array<int, 3> kInk = {20, 22, 26};

Plot plot_of(const TemporaryFolder& folder, const std::string& arguments) {
  const Outcome run = vpsbake(folder, "slice a.vps.hdf -o slice.png " + arguments);
  EXPECT_EQ(run.code, 0) << run.err;
  Plot plot{decode_png(read_file(folder / "slice.png")), run.out, run.err};
  // The frame's left side is the first long line of ink.
  constexpr std::size_t kLeastRows = 120;
  for (std::size_t x = 0, length = 0; plot.left == 0; ++x) {
    for (std::size_t y = 0; y < plot.image.height; ++y) {
      length = plot.image.at(x, y) == kInk ? length + 1 : 0;
      if (length < kLeastRows) continue;
      plot.left = x + 1;
      plot.top = y + 2 - length;
      break;
    }
  }
  plot.right = plot.left;
  while (plot.image.at(plot.right, plot.top) != kInk) ++plot.right;
  plot.bottom = plot.top;
  while (plot.image.at(plot.left, plot.bottom) != kInk) ++plot.bottom;
  std::istringstream words(run.out.substr(run.out.find("a pixel is ") + 11));
  std::string unit;
  words >> plot.pixel >> unit;
  plot.pixel *= unit.starts_with("um") ? 1e-6 : unit.starts_with("mm") ? 1e-3 : 1;
  return plot;
}

// Half the width and half the height of the black pixels in the plot. [m]
std::array<double, 2> zero_radii(const Plot& plot) {
  std::size_t low[2] = {plot.right, plot.bottom}, high[2] = {0, 0};
  for (std::size_t y = plot.top; y < plot.bottom; ++y) {
    for (std::size_t x = plot.left; x < plot.right; ++x) {
      if (plot.image.at(x, y) != kBlack) continue;
      low[0] = std::min(low[0], x);
      low[1] = std::min(low[1], y);
      high[0] = std::max(high[0], x);
      high[1] = std::max(high[1], y);
    }
  }
  // The line's pixel is the first one after the change of sign.
  return {double(high[0] - low[0]) / 2 * plot.pixel, double(high[1] - low[1]) / 2 * plot.pixel};
}

// Whether the picture shows these words with their top left corner at (left, top).
bool shows(const Image& image, std::size_t left, std::size_t top, const std::string& words) {
  cli::Picture picture(cli::Picture::width_of(words), 14);
  picture.write(0, 0, words);
  const Image wanted = decode_png(picture.png());
  for (std::size_t y = 0; y < wanted.height; ++y) {
    for (std::size_t x = 0; x < wanted.width; ++x) {
      if (image.at(left + x, top + y) != wanted.at(x, y)) return false;
    }
  }
  return true;
}

// Lengths of the written pieces, in order: runs of inked lines with fewer than `gap` blank ones between. [px]
std::vector<std::size_t> runs(std::size_t first, std::size_t last, std::size_t gap,
                              const std::function<bool(std::size_t)>& is_inked) {
  std::vector<std::size_t> lengths;
  std::size_t blank = gap;
  for (std::size_t i = first; i < last; ++i) {
    if (!is_inked(i)) {
      ++blank;
      continue;
    }
    if (blank >= gap) {
      lengths.push_back(1);
    } else {
      lengths.back() += blank + 1;
    }
    blank = 0;
  }
  return lengths;
}

// Words and numbers of the axes and the legend touch neither each other nor the picture's edge.
void expect_legible(const Plot& plot) {
  const Image& image = plot.image;
  const auto row_inked = [&](std::size_t left, std::size_t right) {
    return [&image, left, right](std::size_t y) {
      for (std::size_t x = left; x < right; ++x) {
        if (image.at(x, y) == kInk) return true;
      }
      return false;
    };
  };
  constexpr std::size_t kLetters = 14, kHead = 30, kTicks = 9, kLegend = 60;
  for (const auto& [left, right] :
       {std::pair{std::size_t{0}, plot.left - kTicks}, {plot.right + kLegend, image.width}}) {
    const auto heights = runs(plot.top - kHead, image.height, 1, row_inked(left, right));
    EXPECT_GE(heights.size(), 2U);
    for (const std::size_t height : heights) EXPECT_LE(height, kLetters);
  }
  const auto column_inked = [&](std::size_t top, std::size_t bottom) {
    return [&image, top, bottom](std::size_t x) {
      for (std::size_t y = top; y < bottom; ++y) {
        if (image.at(x, y) == kInk) return true;
      }
      return false;
    };
  };
  const std::size_t below = plot.bottom + 1;
  const std::size_t ticks = runs(plot.left, plot.right, 2, column_inked(below + 2, below + 5)).size();
  EXPECT_GE(ticks, 1U);
  EXPECT_EQ(runs(0, plot.right + 20, 13, column_inked(below + 10, below + 24)).size(), ticks);
  EXPECT_FALSE(column_inked(0, image.height)(image.width - 1));
}

TriangleMesh moved(TriangleMesh mesh, double x, double z) {
  for (auto& p : mesh.vertices) p = {p[0] + x, p[1], p[2] + z};
  return mesh;
}

std::string obj_of(const TriangleMesh& mesh) {
  std::string text;
  for (const auto& p : mesh.vertices)
    text += "v " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
  for (const auto& [a, b, c] : mesh.triangles)
    text += "f " + std::to_string(a + 1) + " " + std::to_string(b + 1) + " " + std::to_string(c + 1) + "\n";
  return text;
}
// A box with these half extents, centred at the origin.
std::string box_obj(double x, double y, double z) {
  return obj_of(samples::make_box({x, y, z}));
}

class Slice : public ::testing::Test {
 protected:
  static constexpr double kRadius = 0.05;  // of the sample's icosphere
  void SetUp() override {
    const Outcome run = vpsbake(folder_, sample("icosphere") + " --voxel 2mm --fields layers,scaled,real -o a.vps.hdf");
    ASSERT_EQ(run.code, 0) << run.err;
  }
  TemporaryFolder folder_;
};

TEST_F(Slice, TheZeroLineOfASphereHasItsRadiusAtEveryPlace) {
  for (const char* const axis : {"x", "y", "z"}) {
    for (const char* const field : {"scaled", "real"}) {
      for (const double at_mm : {0.0, 11.0, -30.0}) {
        const Plot plot = plot_of(
            folder_, std::string("--axis ") + axis + " --field " + field + " --at " + std::to_string(at_mm) + "mm");
        const double expected = std::sqrt(kRadius * kRadius - at_mm * at_mm * 1e-6);
        for (const double radius : zero_radii(plot))
          EXPECT_NEAR(radius, expected, 0.0004 + 1.5 * plot.pixel) << axis << field << at_mm;
      }
    }
  }
  // Layers treat the voxels that the surface touches as inside.
  for (const double radius : zero_radii(plot_of(folder_, "--field layers"))) EXPECT_NEAR(radius, kRadius, 0.003);
}

TEST_F(Slice, OutsideIsBlueInsideIsRedAndEachVoxelOfDistanceHasItsColour) {
  const Plot plot = plot_of(folder_, "");
  const std::array<int, 3> corner = plot.image.at(plot.left, plot.top);
  EXPECT_GT(corner[2], corner[0] + 100);
  EXPECT_GT(plot.centre()[0], plot.centre()[2] + 100);
  // Along the middle row: the steps of colour lie where the distance is a whole number of voxels.
  const std::size_t y = (plot.top + plot.bottom) / 2;
  int steps = 0;
  for (std::size_t x = plot.left + 1; x < (plot.left + plot.right) / 2; ++x) {
    const auto before = plot.image.at(x - 1, y), here = plot.image.at(x, y);
    if (before == here || before == kBlack || here == kBlack) continue;
    const double from_centre = (double(plot.left + plot.right) / 2 - double(x)) * plot.pixel;
    const double voxels = (kRadius - from_centre) / 0.002;
    EXPECT_NEAR(voxels, std::round(voxels), 0.3) << x;
    ++steps;
  }
  EXPECT_GE(steps, 3);
}

TEST_F(Slice, ThePictureIsAsWideAsAsked) {
  EXPECT_EQ(plot_of(folder_, "--width 600").image.width, 600U);
  EXPECT_EQ(plot_of(folder_, "--width 1400").image.width, 1400U);
  EXPECT_EQ(vpsbake(folder_, "slice a.vps.hdf --axis y").code, 0);
  EXPECT_EQ(read_file(folder_ / "a_y.png").substr(0, 4), "\x89PNG");
}

TEST_F(Slice, ATallBodyIsDrawnWhole) {
  write_file(folder_ / "rod.obj", box_obj(0.001, 0.001, 0.1));
  ASSERT_EQ(vpsbake(folder_, "rod.obj --voxel 0.2mm -o a.vps.hdf").code, 0);
  const Plot plot = plot_of(folder_, "--axis x");
  EXPECT_LE(plot.image.height, 3200U);
  const std::array<double, 2> half = zero_radii(plot);
  EXPECT_NEAR(half[0], 0.001, 0.0001);
  EXPECT_NEAR(half[1], 0.1, 0.0002);
}

TEST_F(Slice, TheHeadNamesTheAssetItsVoxelAndThePlace) {
  std::filesystem::rename(folder_ / "a.vps.hdf", folder_ / "Ball_2 (x).vps.hdf");
  ASSERT_EQ(vpsbake(folder_, "slice 'Ball_2 (x).vps.hdf' --axis x --at 11mm -o slice.png").code, 0);
  const Image image = decode_png(read_file(folder_ / "slice.png"));
  EXPECT_TRUE(shows(image, 8, 10, "Ball_2 (x), voxel 2 mm"));
  EXPECT_TRUE(shows(image, 8, 32, "x = 11 mm, field real"));
  EXPECT_FALSE(shows(image, 8, 10, "Ball_2 (y), voxel 2 mm"));
  // A long name is shown without its middle.
  const std::string name(60, 'n');
  std::filesystem::rename(folder_ / "Ball_2 (x).vps.hdf", folder_ / (name + ".vps.hdf"));
  ASSERT_EQ(vpsbake(folder_, "slice " + name + ".vps.hdf --width 600 -o slice.png").code, 0);
  const std::string half(17, 'n');
  EXPECT_TRUE(shows(decode_png(read_file(folder_ / "slice.png")), 8, 10, half + ".." + half + ", voxel 2 mm"));
}

TEST_F(Slice, NothingOverlapsWhateverTheShapeTheBandAndTheScale) {
  write_file(folder_ / "plate.obj", box_obj(0.1, 0.1, 0.004));
  write_file(folder_ / "rod.obj", box_obj(0.01, 0.01, 0.05));
  write_file(folder_ / "far.obj", obj_of(moved(samples::make_box({0.1, 0.1, 0.004}), 123.4, 0)));
  const char* const bodies[] = {"plate.obj --voxel 4mm",
                                "plate.obj --voxel 4mm --band-inside 8vx --band-outside 8vx",
                                "plate.obj --voxel 4.938um --scale 1e-3",
                                "plate.obj --voxel 395.12m --scale 1e5",
                                "rod.obj --voxel 2mm",
                                "far.obj --voxel 4mm"};
  for (const char* const body : bodies) {
    ASSERT_EQ(vpsbake(folder_, std::string(body) + " -o a.vps.hdf").code, 0);
    for (const char* const options : {"--axis x --width 600", "--axis z --width 600"}) {
      SCOPED_TRACE(std::string(body) + " " + options);
      expect_legible(plot_of(folder_, options));
    }
  }
}

TEST_F(Slice, WithoutAZeroLineItSaysWhatThereIsInstead) {
  // Two boxes with a gap between them, wider than the bands.
  const TriangleMesh cube = samples::make_box({0.01, 0.01, 0.01});
  write_file(folder_ / "boxes.obj", obj_of(joined(moved(cube, 0, -0.03), moved(cube, 0, 0.03))));
  ASSERT_EQ(vpsbake(folder_, "boxes.obj --voxel 1mm -o a.vps.hdf").code, 0);
  const Plot gap = plot_of(folder_, "");
  EXPECT_EQ(gap.err, "vpsbake: note: slice.png: no zero line: all outside, out of the band\n");
  EXPECT_TRUE(shows(gap.image, 8, 54, "no zero line: all outside, out of the band"));
  const Plot near = plot_of(folder_, "--at 19mm");
  EXPECT_EQ(near.err, "vpsbake: note: slice.png: no zero line: all outside\n");
  EXPECT_EQ(plot_of(folder_, "--at 21mm").err, "");
}

TEST_F(Slice, WhatCannotBeDrawnIsRefusedInOneLine) {
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 2mm --parts pointshell -o shell.vps.hdf").code, 0);
  ASSERT_EQ(vpsbake(folder_, sample("cube") + " --voxel 2mm -o scaled.vps.hdf").code, 0);
  write_file(folder_ / "junk.vps.hdf", "no asset");
  write_file(folder_ / "notes.png", "mine");
  expect_refusal(folder_, "slice a.vps.hdf --at 1m", 3, "beyond the field; choose z from -55mm to 55mm");
  expect_refusal(folder_, "slice a.vps.hdf --at -56mm", 3, "from -55mm to 55mm");
  expect_refusal(folder_, "slice a.vps.hdf --at 12", 1, "--at: a length needs a unit; write 12mm or 12m");
  expect_refusal(folder_, "slice a.vps.hdf --at nanmm", 1, "is not a");
  expect_refusal(folder_, "slice a.vps.hdf --at 12furlongs", 1, "unknown unit");
  expect_refusal(folder_, "slice a.vps.hdf --axis w", 1, "axis");
  expect_refusal(folder_, "slice a.vps.hdf --width 10", 1, "600 to 8000");
  expect_refusal(folder_, "slice scaled.vps.hdf --field real", 3, "--fields real");
  expect_refusal(folder_, "slice shell.vps.hdf", 3, "no voxelmap");
  expect_refusal(folder_, "slice junk.vps.hdf", 3, "junk.vps.hdf");
  expect_refusal(folder_, "slice absent.vps.hdf", 2, "absent.vps.hdf");
  expect_refusal(folder_, "slice .", 2, "folder");
  expect_refusal(folder_, "slice a.vps.hdf -o .", 2, "folder");
  expect_refusal(folder_, "slice a.vps.hdf -o notes.png", 2, "not a PNG");
  expect_refusal(folder_, "slice a.vps.hdf -o a.vps.hdf", 2, "not a PNG");
  EXPECT_EQ(read_file(folder_ / "notes.png"), "mine");
}

TEST(SliceOfLayers, HasAColourForEachLayerWhateverTheVoxel) {
  const TemporaryFolder folder;
  for (const char* const voxel : {"1.5mm", "2mm", "2.1mm", "2.3mm"}) {
    ASSERT_EQ(vpsbake(folder, sample("icosphere") + " --fields layers --voxel " + voxel + " -o a.vps.hdf").code, 0);
    const Plot plot = plot_of(folder, "");
    std::set<std::array<int, 3>> colours;
    for (std::size_t y = plot.top; y < plot.bottom; ++y) {
      for (std::size_t x = plot.left; x < plot.right; ++x) colours.insert(plot.image.at(x, y));
    }
    EXPECT_EQ(colours.size(), 6U + 1) << voxel;  // three voxels on each side, and the line
  }
}

}  // namespace
}  // namespace vps::test

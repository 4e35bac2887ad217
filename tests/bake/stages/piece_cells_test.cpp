// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/piece_cells.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>

#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr double kSpacing = 0.01;
constexpr double kReach = 1.05 * kSpacing;

// A sphere with a sample at random on each of its patches.
struct SampledSphere {
  SampledSphere() {
    Random random(1);
    for (Block& block : blocks.blocks()) {
      blocks.for_each_patch(block, [&](const Patch& patch) {
        const double u = random.next();
        const double v = random.next() * (1 - u);
        const Vector p = u * patch.piece[0] + v * patch.piece[1] + (1 - u - v) * patch.piece[2];
        blocks.insert(block, p, surface.normals[patch.triangle]);
      });
    }
  }

  Surface surface = checked(make_sphere(0.1, 4));
  SurfaceBlocks blocks{surface, 2 * kSpacing};
};

// One sample after the other, as described at `NearSamples::find` and `PieceCells::candidates`.
std::vector<PieceCells::Candidate> candidates_one_by_one(const SurfaceBlocks& blocks, const Block& home,
                                                         const Piece& piece, const Vector& normal) {
  std::vector<PieceCells::Candidate> found;
  const auto may_have_cell = [&](const PieceCells::Candidate& c) {
    const CornerDistances& first = found.front().squared;
    return c.squared[0] < first[0] || c.squared[1] < first[1] || c.squared[2] < first[2];
  };
  const Vector low = piece[0].cwiseMin(piece[1]).cwiseMin(piece[2]);
  const Vector high = piece[0].cwiseMax(piece[1]).cwiseMax(piece[2]);
  blocks.for_each_near(home, low, high, kReach, [&](Sample& s) {
    if (normal.dot(s.normal) <= kSameSide) return true;
    PieceCells::Candidate c{&s, {}, 0};
    for (std::size_t k = 0; k < 3; ++k) c.squared[k] = (s.position - piece[k]).squaredNorm();
    c.farthest = *std::max_element(c.squared.begin(), c.squared.end());
    if (!found.empty() && !may_have_cell(c)) return true;
    found.push_back(c);
    if (c.farthest < found.front().farthest) std::swap(found.front(), found.back());
    return true;
  });
  if (found.empty()) return found;
  found.erase(std::remove_if(found.begin() + 1, found.end(), [&](const auto& c) { return !may_have_cell(c); }),
              found.end());
  return found;
}

void expect_same_candidates() {
  SampledSphere sphere;
  std::size_t most = 0;
  for (Block& block : sphere.blocks.blocks()) {
    PieceCells cells(sphere.blocks, kReach);
    sphere.blocks.for_each_patch(block, [&](const Patch& patch) {
      const Vector& normal = sphere.surface.normals[patch.triangle];
      cells.start(block, patch.piece, normal);
      cells.add(*sphere.blocks.insert(block, centroid(patch.piece), normal));
      cells.start(block, patch.piece, normal);
      const auto expected = candidates_one_by_one(sphere.blocks, block, patch.piece, normal);
      ASSERT_EQ(cells.candidates().size(), expected.size());
      for (std::size_t n = 0; n < expected.size(); ++n) {
        ASSERT_EQ(cells.candidates()[n].sample, expected[n].sample);
        ASSERT_EQ(cells.candidates()[n].squared, expected[n].squared);
        ASSERT_EQ(cells.candidates()[n].farthest, expected[n].farthest);
      }
      most = std::max(most, expected.size());
    });
  }
  EXPECT_GT(most, 4U);
}

// Coverage is only stated where it is true, and where there is room to spare it is.
void expect_true_coverage() {
  SampledSphere sphere;
  for (const Block& block : sphere.blocks.blocks()) {
    PieceCells cells(sphere.blocks, kReach);
    sphere.blocks.for_each_patch(block, [&](const Patch& patch) {
      cells.start(block, patch.piece, sphere.surface.normals[patch.triangle]);
      double far = 0;
      for (const PieceCells::Candidate& c : cells.candidates()) {
        for (const PieceCells::Place& p : cells.cell(c)) far = std::max(far, cells.squared_distance(c, p));
      }
      ASSERT_FALSE(cells.surely_covered(0.9999 * far));
      ASSERT_TRUE(cells.surely_covered(2 * far));
    });
  }
}

void with_each_instruction_set(void (*check)()) {
  for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
    SCOPED_TRACE(hwy::TargetName(targets & -targets));
    hwy::DisableTargets(~(targets & -targets));
    check();
    hwy::DisableTargets(0);
  }
}

TEST(PieceCells, CandidatesAreThoseOfOneSampleAfterTheOther) {
  with_each_instruction_set(expect_same_candidates);
}
TEST(PieceCells, OnlyCoveredPiecesAreSurelyCovered) {
  with_each_instruction_set(expect_true_coverage);
}

}  // namespace
}  // namespace vps::test

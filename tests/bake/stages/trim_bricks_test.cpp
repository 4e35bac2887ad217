// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/trim_bricks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "formats/brick_faces.h"
#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;
namespace {

constexpr double kVoxel = 0.002;
constexpr double kBand = 2.5 * kVoxel;

SampleForm form(bool real) {
  return {.real = real, .lambda = kBand / 127, .limit = 127, .band_inner = kBand, .band_outer = kBand};
}

FieldTree sampled(bool real, const TriangleMesh& mesh = make_torus(0.05, 0.017, 24, 12)) {
  const Scene scene(mesh, kVoxel, 3.5);
  const InsideTest inside(scene.surface, scene.grid);
  return sample_field(scene.surface, scene.grid, scene.runs, scene.field, inside, {0.1 * kVoxel, kBand, kBand},
                      form(real));
}

using Numbers = std::array<std::size_t, 8>;

// Calls visit(level, corners, stored) for each cell to which an entry leads: the numbers of its samples in the tree,
// and among those stored.
template <class Visit>
void for_each_cell(const FieldTree& tree, const TrimmedTree& trimmed, Visit visit) {
  const auto for_each_entry = [&](const std::vector<std::uint32_t>& roots, const std::vector<std::uint32_t>& nodes,
                                  const auto& visit_entry) {
    const octree::Octree octree{roots.data(), nodes.data(), tree.root_dims.data()};
    for (std::size_t root = 0; root < octree.root_count(); ++root)
      octree::for_each_brick_entry(octree, root, visit_entry);
  };
  std::vector<std::uint32_t> entries;
  for_each_entry(trimmed.roots, trimmed.nodes,
                 [&](std::uint32_t entry, const auto&, std::uint32_t) { entries.push_back(entry); });
  std::size_t next = 0;
  for_each_entry(tree.roots, tree.nodes, [&](std::uint32_t entry, const std::uint32_t(&cell)[3], std::uint32_t edge) {
    const std::uint32_t stored = entries.at(next++);
    ASSERT_EQ(octree::level_of(stored), octree::level_of(entry));
    const double h = std::ldexp(1.0, octree::level_of(entry));
    const auto cells = static_cast<std::uint32_t>(std::max(edge / h, 1.0));
    for (std::uint32_t n = 0; n < cells * cells * cells; ++n) {
      const std::uint32_t at[3] = {static_cast<std::uint32_t>(cell[0] / h + n % cells) % 4,
                                   static_cast<std::uint32_t>(cell[1] / h + n / cells % cells) % 4,
                                   static_cast<std::uint32_t>(cell[2] / h + n / cells / cells) % 4};
      Numbers whole;
      Numbers kept;
      for (std::size_t corner = 0; corner < 8; ++corner) {
        whole[corner] = octree::corners_of(entry, at).number(corner);
        kept[corner] = octree::corners_of(stored, at).number(corner);
      }
      visit(octree::level_of(entry), whole, kept);
    }
  });
  ASSERT_EQ(next, entries.size());
}

TEST(TrimBricks, ACellChangesOnlyBeyondTheBandAndOnlyTowardsIt) {
  const FieldTree tree = sampled(false);
  const TrimmedTree trimmed = trim_bricks(tree, form(false));
  const UnsetVector<std::int16_t> scaled = trimmed.stored<std::int16_t>(tree.scaled);
  ASSERT_EQ(scaled.size(), kFieldSlice * trimmed.slices);
  std::size_t same = 0;
  std::size_t changed = 0;
  for_each_cell(tree, trimmed, [&](int level, const Numbers& whole, const Numbers& kept) {
    const auto is_same = [&](std::size_t n, std::size_t m) { return tree.scaled.at(n) == scaled.at(m); };
    if (std::equal(whole.begin(), whole.end(), kept.begin(), is_same)) {
      ++same;
      return;
    }
    ++changed;
    const int side = tree.scaled.at(whole[0]) > 0 ? 1 : -1;
    const int end = level > 0 ? 64 : 127;  // the first step that is not in the band
    for (std::size_t corner = 0; corner < 8; ++corner) {
      ASSERT_GE(side * scaled.at(kept[corner]), end);
      ASSERT_LE(side * scaled.at(kept[corner]), side * tree.scaled.at(whole[corner]));
    }
  });
  EXPECT_GT(same, 20 * changed);
  EXPECT_GT(changed, 100U);
}

TEST(TrimBricks, GradientsAndTheirSamplesStayTheSame) {
  const FieldTree tree = sampled(true);
  const TrimmedTree trimmed = trim_bricks(tree, form(true));
  const UnsetVector<float> gradient = trimmed.stored<float>(tree.gradient, 3);
  ASSERT_EQ(trimmed.stored<double>(tree.penetration).size(), kFieldSlice * trimmed.slices);
  ASSERT_EQ(gradient.size(), 3 * kFieldSlice * trimmed.slices);
  for_each_cell(tree, trimmed, [&](int, const Numbers& whole, const Numbers& kept) {
    for (std::size_t corner = 0; corner < 8; ++corner) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        ASSERT_EQ(tree.gradient.at(3 * whole[corner] + axis), gradient.at(3 * kept[corner] + axis));
    }
  });
  EXPECT_LT(trimmed.slices, kFieldEdge * tree.bricks);
}

TEST(TrimBricks, SlicesAreLeftOutAtBothEndsOfEveryAxis) {
  const FieldTree tree = sampled(false);
  const TrimmedTree trimmed = trim_bricks(tree, form(false));
  EXPECT_LT(static_cast<double>(trimmed.slices), 0.92 * kFieldEdge * static_cast<double>(tree.bricks));
  std::set<std::uint32_t> ends;
  std::size_t slices = 0;
  for (const std::uint32_t number : trimmed.kept) {
    const octree::Slices& brick = trimmed.bricks[number];
    slices += brick.count;
    if (brick.count < kFieldEdge) ends.insert(2 * brick.axis + (brick.first > 0 ? 1 : 0));
  }
  EXPECT_EQ(ends.size(), 6U);
  EXPECT_EQ(slices, trimmed.slices);
}

TEST(TrimBricks, FacesThatAreLevelInTheGridShareTheirSamples) {
  const TriangleMesh slab = make_box({0.15, 0.15, 0.02});
  const FieldTree tree = sampled(false, slab);
  const TrimmedTree trimmed = trim_bricks(tree, form(false));
  EXPECT_LT(8 * trimmed.kept.size(), tree.bricks);
  const UnsetVector<std::int16_t> scaled = trimmed.stored<std::int16_t>(tree.scaled);
  ASSERT_EQ(scaled.size(), kFieldSlice * trimmed.slices);
  for_each_cell(tree, trimmed, [&](int, const Numbers& whole, const Numbers& kept) {
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const int v = tree.scaled.at(whole[corner]);
      if (std::abs(v) >= 64) continue;  // beyond the band
      ASSERT_EQ(scaled.at(kept[corner]), v);
    }
  });
  const FieldTree exact = sampled(true, slab);
  EXPECT_EQ(trim_bricks(exact, form(true)).kept.size(), exact.bricks);
}

}  // namespace
}  // namespace vps::test

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/octant_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps::bake {
namespace {

constexpr int kHalo = ChordLines::kHalo;
constexpr int kSide = ChordLines::kSide;
static_assert(kSide == OctantSamples::kSide);
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// The line along an axis through a sample.
constexpr int line_of(int axis, int x, int y, int z) {
  return axis == 0 ? z * kSide + y : axis == 1 ? z * kSide + x : y * kSide + x;
}

// Combines the errors of the two chords at a sample: the largest error in each direction counts.
float both_ways(float a, float b) {
  return std::max({a, b, 0.0F}) + std::min({a, b, 0.0F});
}

}  // namespace

void cell_errors(const ChordLines& lines, CellErrors& errors) {
  constexpr auto kCells = static_cast<int>(kBrickEdge);
  const auto largest_of_four = [&](int axis, int place, int line) {
    const float* const at = lines.error[axis][1 + place] + line;
    return std::max({std::abs(at[0]), std::abs(at[1]), std::abs(at[kSide]), std::abs(at[kSide + 1])});
  };
  for (int z = 0; z < kCells; ++z) {
    for (int y = 0; y < kCells; ++y) {
      for (int x = 0; x < kCells; ++x) {
        errors[static_cast<std::size_t>((z * kCells + y) * kCells + x)] = largest_of_four(0, x, line_of(0, x, y, z)) +
                                                                          largest_of_four(1, y, line_of(1, x, y, z)) +
                                                                          largest_of_four(2, z, line_of(2, x, y, z));
      }
    }
  }
}

void OctantSamples::load(const Index3& brick) {
  // The brick and its neighbours: places from -8 to 15.
  std::array<std::uint32_t, 27> bricks;
  for (std::uint32_t n = 0; n < 27; ++n) {
    const std::uint32_t at[3] = {brick[0] + n % 3 - 1, brick[1] + n / 3 % 3 - 1, brick[2] + n / 9 - 1};
    const bool in_grid = at[0] < grid_.brick_dims[0] && at[1] < grid_.brick_dims[1] && at[2] < grid_.brick_dims[2];
    bricks[n] = in_grid ? field_.set.index[grid_.brick_at(at[0], at[1], at[2])] : kNoBrick;
  }
  constexpr auto kEdge = static_cast<int>(kBrickEdge);
  const auto per_voxel = static_cast<float>(1 / grid_.voxel_size);
  std::fill_n(&lines_.value[0][0][0], sizeof(lines_.value) / sizeof(float), kUnknown);
  for (int z = -kHalo; z < kSide + kHalo; ++z) {
    const bool z_out = z < 0 || z >= kSide;
    for (int y = -kHalo; y < kSide + kHalo; ++y) {
      const bool y_out = y < 0 || y >= kSide;
      if (z_out && y_out) continue;
      const bool row_out = z_out || y_out;
      const int row_brick = ((z + kEdge) / kEdge * 3 + (y + kEdge) / kEdge) * 3;
      const int row_voxel = ((z + kEdge) % kEdge * kEdge + (y + kEdge) % kEdge) * kEdge;
      for (int x = row_out ? 0 : -kHalo; x < (row_out ? kSide : kSide + kHalo); ++x) {
        const std::uint32_t stored = bricks[static_cast<std::size_t>(row_brick + (x + kEdge) / kEdge)];
        float v = kUnknown;
        double exact = 0;
        std::uint32_t closest = kNoTriangle;
        if (stored != kNoBrick) {
          const std::size_t at = field_.at(stored, static_cast<std::uint32_t>(row_voxel + (x + kEdge) % kEdge));
          exact = field_.penetration[at];
          closest = field_.closest[at];
          if (closest != kNoTriangle) v = static_cast<float>(exact) * per_voxel;
        }
        const bool x_out = x < 0 || x >= kSide;
        if (!row_out && !x_out) {
          if (stored == kNoBrick) {
            const std::uint32_t i[3] = {brick[0] * kBrickEdge + static_cast<std::uint32_t>(x),
                                        brick[1] * kBrickEdge + static_cast<std::uint32_t>(y),
                                        brick[2] * kBrickEdge + static_cast<std::uint32_t>(z)};
            const bool in_grid = i[0] < grid_.dims[0] && i[1] < grid_.dims[1] && i[2] < grid_.dims[2];
            exact = in_grid && runs_.test(grid_, i[0], i[1], i[2]) ? field_.band_inner : -field_.band_outer;
          }
          value_[number(x, y, z)] = exact;
          closest_[number(x, y, z)] = closest;
        }
        if (!row_out) lines_.value[0][x + kHalo][line_of(0, x, y, z)] = v;
        if (!z_out && !x_out) lines_.value[1][y + kHalo][line_of(1, x, y, z)] = v;
        if (!y_out && !x_out) lines_.value[2][z + kHalo][line_of(2, x, y, z)] = v;
      }
    }
  }
}

void OctantSamples::estimate() {
  chord_errors(lines_);
  cell_errors(lines_, errors_);
}

double OctantSamples::shift(int x, int y, int z) const {
  const int place[3] = {x, y, z};
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int line = line_of(axis, x, y, z);
    sum += both_ways(lines_.error[axis][place[axis]][line], lines_.error[axis][place[axis] + 1][line]);
  }
  // Half of the correction, which is too large at sharp creases. Found by experiment: fewest bricks, least error.
  constexpr float kShare = 0.25F;
  return -kShare * sum;
}

double OctantSamples::shift_of_two(int x, int y, int z) const {
  const int place[3] = {x, y, z};
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const int line = line_of(axis, x, y, z);
    const auto value = [&](int step) { return lines_.value[axis][kHalo + place[axis] + step][line]; };
    float error[2] = {(value(0) + value(-2)) / 2 - value(-1), (value(0) + value(2)) / 2 - value(1)};
    for (float& e : error) {
      if (std::isnan(e)) e = 0;
    }
    sum += both_ways(error[0], error[1]);
  }
  constexpr float kShare = 0.425F;
  return -kShare * sum;
}

}  // namespace vps::bake

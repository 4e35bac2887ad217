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
  return std::max(std::max(a, b), 0.0F) + std::min(std::min(a, b), 0.0F);
}

// Where a row along x lies: the first of its three bricks, and its first voxel in them.
struct RowPlace {
  std::size_t bricks;
  std::uint32_t voxels;
};
RowPlace row_place(int y, int z) {
  constexpr auto kEdge = static_cast<int>(kBrickEdge);
  return {static_cast<std::size_t>(((z + kEdge) / kEdge * 3 + (y + kEdge) / kEdge) * 3),
          static_cast<std::uint32_t>(((z + kEdge) % kEdge * kEdge + (y + kEdge) % kEdge) * kEdge)};
}

// Which voxels of a part of a brick's row are exact.
struct ExactRow {
  std::uint64_t bits;
  bool all;
  [[nodiscard]] bool has(std::uint32_t n) const { return (bits >> n & 1) != 0; }
};
ExactRow exact_bits(const BandField& field, std::uint32_t brick, std::uint32_t voxel, std::uint32_t count) {
  const std::uint64_t all = (std::uint64_t{1} << count) - 1;
  const std::uint64_t bits = field.exact[brick][voxel / 64] >> voxel % 64 & all;
  return {bits, bits == all};
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
  std::fill_n(&lines_.value[0][0][0], sizeof(lines_.value) / sizeof(float), kUnknown);
  constexpr int kEnd = kSide + kHalo;
  for (int z = -kHalo; z < kEnd; ++z) {
    const bool z_out = z < 0 || z >= kSide;
    for (int y = -kHalo; y < kEnd; ++y) {
      const bool y_out = y < 0 || y >= kSide;
      if (z_out && y_out) continue;
      float row[kEnd + kHalo];
      load_row(bricks, y, z, row);
      const float* const first = row + kHalo;
      if (!z_out) std::copy_n(first, kSide, &lines_.value[1][y + kHalo][line_of(1, 0, y, z)]);
      if (!y_out) std::copy_n(first, kSide, &lines_.value[2][z + kHalo][line_of(2, 0, y, z)]);
      if (z_out || y_out) continue;
      for (int x = 0; x < kEnd + kHalo; ++x) lines_.value[0][x][line_of(0, 0, y, z)] = row[x];
      load_exact(brick, bricks, y, z);
    }
  }
}

// Values from three voxels before the brick to three behind its samples, unknown beyond the band.
void OctantSamples::load_row(const std::array<std::uint32_t, 27>& bricks, int y, int z, float* row) const {
  const RowPlace at = row_place(y, z);
  const auto per_voxel = static_cast<float>(1 / grid_.voxel_size);
  const auto convert = [&](std::size_t of_row, std::uint32_t first, std::uint32_t count, float* to) {
    const std::uint32_t stored = bricks[at.bricks + of_row];
    if (stored == kNoBrick) {
      std::fill_n(to, count, kUnknown);
      return;
    }
    const ExactRow exact = exact_bits(field_, stored, at.voxels + first, count);
    const double* from = field_.penetration.data() + field_.at(stored, at.voxels + first);
    if (exact.all) {
      for (std::uint32_t i = 0; i < count; ++i) to[i] = static_cast<float>(from[i]) * per_voxel;
      return;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      to[i] = exact.has(i) ? static_cast<float>(*from++) * per_voxel : kUnknown;
    }
  };
  convert(0, kBrickEdge - kHalo, kHalo, row);
  convert(1, 0, kBrickEdge, row + kHalo);
  convert(2, 0, kHalo + 1, row + kHalo + kBrickEdge);
}

void OctantSamples::load_exact(const Index3& brick, const std::array<std::uint32_t, 27>& bricks, int y, int z) {
  const RowPlace at = row_place(y, z);
  const auto is_inside = [&](std::uint32_t x) {
    const std::uint32_t i[3] = {brick[0] * kBrickEdge + x, brick[1] * kBrickEdge + static_cast<std::uint32_t>(y),
                                brick[2] * kBrickEdge + static_cast<std::uint32_t>(z)};
    return i[0] < grid_.dims[0] && i[1] < grid_.dims[1] && i[2] < grid_.dims[2] && runs_.test(grid_, i[0], i[1], i[2]);
  };
  const auto load = [&](std::uint32_t stored, std::uint32_t first, std::uint32_t end) {
    const std::size_t to = number(0, y, z) + first;
    const std::uint32_t count = end - first;
    std::size_t from = stored != kNoBrick ? field_.at(stored, at.voxels) : 0;
    const ExactRow exact = stored != kNoBrick ? exact_bits(field_, stored, at.voxels, count) : ExactRow{0, false};
    if (exact.all) {
      std::copy_n(field_.penetration.data() + from, count, value_.data() + to);
      std::copy_n(field_.closest.data() + from, count, closest_.data() + to);
      return;
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      closest_[to + i] = exact.has(i) ? field_.closest[from] : kNoTriangle;
      if (exact.has(i)) {
        value_[to + i] = field_.penetration[from++];
      } else {
        const bool within = stored != kNoBrick ? test_bit(field_.inside[stored], at.voxels + i) : is_inside(first + i);
        value_[to + i] = within ? field_.band_inner : -field_.band_outer;
      }
    }
  };
  load(bricks[at.bricks + 1], 0, kBrickEdge);
  load(bricks[at.bricks + 2], kBrickEdge, kSide);
}

void OctantSamples::estimate() {
  chord_errors(lines_);
  cell_errors(lines_, errors_);
  add_shifts();
}

// Half of the correction, which is too large at sharp creases. Found by experiment: fewest bricks, least error.
void OctantSamples::add_shifts() {
  constexpr float kShare = 0.25F;
  constexpr int kPlane = kSide * kSide;
  float along[3][kSide][kPlane];
  for (int axis = 0; axis < 3; ++axis) {
    for (int place = 0; place < kSide; ++place) {
      for (int line = 0; line < kPlane; ++line) {
        along[axis][place][line] = both_ways(lines_.error[axis][place][line], lines_.error[axis][place + 1][line]);
      }
    }
  }
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const float sum =
            along[0][x][line_of(0, x, y, z)] + along[1][y][line_of(1, x, y, z)] + along[2][z][line_of(2, x, y, z)];
        shift_[number(x, y, z)] = -kShare * sum;
      }
    }
  }
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

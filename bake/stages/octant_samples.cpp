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

// The exact voxels of a plane of a brick, by its rows along x.
class PlaneRows {
 public:
  PlaneRows() = default;  // of a brick that is not there
  PlaneRows(const BandField& field, std::uint32_t brick, std::size_t plane)
      : bits_(field.exact[brick][plane]), first_(field.start[brick].first + field.start[brick].plane[plane]) {
    // Counts the bits of each byte. Multiplied, each byte holds its own count and those of all below it.
    std::uint64_t counts = bits_ - (bits_ >> 1 & 0x5555555555555555);
    counts = (counts & 0x3333333333333333) + (counts >> 2 & 0x3333333333333333);
    counts = (counts + (counts >> 4)) & 0x0F0F0F0F0F0F0F0F;
    up_to_ = counts * 0x0101010101010101;
  }
  [[nodiscard]] bool has(std::size_t row, int x) const {
    return (bits_ >> (8 * row + static_cast<unsigned>(x)) & 1) != 0;
  }
  [[nodiscard]] bool all(std::size_t row) const { return (bits_ >> 8 * row & 0xFF) == 0xFF; }
  // Places of a row's exact voxels in the field.
  [[nodiscard]] std::size_t begin(std::size_t row) const { return first_ + (up_to_ << 8 >> 8 * row & 0xFF); }
  [[nodiscard]] std::size_t end(std::size_t row) const { return first_ + (up_to_ >> 8 * row & 0xFF); }

 private:
  std::uint64_t bits_ = 0;
  std::size_t first_ = 0;
  std::uint64_t up_to_ = 0;
};

}  // namespace

void cell_errors(const ChordLines& lines, CellErrors& errors) {
  constexpr auto kCells = static_cast<int>(kBrickEdge);
  constexpr int kTwo = kSide * kSide - 1;
  constexpr int kFour = kTwo - kSide;
  float four[3][kCells][kFour];  // the largest of the four chords of a cell
  for (int axis = 0; axis < 3; ++axis) {
    for (int place = 0; place < kCells; ++place) {
      const float* const error = lines.error[axis][1 + place];
      float two[kTwo];
      for (int line = 0; line < kTwo; ++line) two[line] = std::max(std::abs(error[line]), std::abs(error[line + 1]));
      for (int line = 0; line < kFour; ++line) four[axis][place][line] = std::max(two[line], two[line + kSide]);
    }
  }
  for (int z = 0; z < kCells; ++z) {
    for (int y = 0; y < kCells; ++y) {
      for (int x = 0; x < kCells; ++x) {
        errors[static_cast<std::size_t>((z * kCells + y) * kCells + x)] =
            four[0][x][line_of(0, x, y, z)] + four[1][y][line_of(1, x, y, z)] + four[2][z][line_of(2, x, y, z)];
      }
    }
  }
}

OctantSamples::OctantSamples(const Grid& grid, const InsideRuns& runs, const BandField& field)
    : grid_(grid), runs_(runs), field_(field) {
  // The padding of lines stays so.
  std::fill_n(&lines_.value[0][0][0], sizeof(lines_.value) / sizeof(float), kUnknown);
}

void OctantSamples::load(const Index3& brick) {
  // The brick and its neighbours: places from -8 to 15.
  for (std::uint32_t n = 0; n < 27; ++n) {
    const std::uint32_t at[3] = {brick[0] + n % 3 - 1, brick[1] + n / 3 % 3 - 1, brick[2] + n / 9 - 1};
    const bool in_grid = at[0] < grid_.brick_dims[0] && at[1] < grid_.brick_dims[1] && at[2] < grid_.brick_dims[2];
    bricks_[n] = in_grid ? field_.set.index[grid_.brick_at(at[0], at[1], at[2])] : kNoBrick;
  }
  for (std::uint32_t n = 0; n < 8; ++n) {
    const std::uint32_t upper[3] = {n & 1, n >> 1 & 1, n >> 2};
    std::size_t count[3];
    for (std::size_t axis = 0; axis < 3; ++axis) count[axis] = upper[axis] != 0 ? 1 : kBrickEdge;
    const std::uint32_t stored = bricks_[((1 + upper[2]) * 3 + 1 + upper[1]) * 3 + 1 + upper[0]];
    const std::size_t first = number(static_cast<int>(upper[0] * kBrickEdge), static_cast<int>(upper[1] * kBrickEdge),
                                     static_cast<int>(upper[2] * kBrickEdge));
    const auto row_at = [&](std::size_t y, std::size_t z) { return first + (z * kSide + y) * kSide; };
    if (stored == kNoBrick) {
      // The surface is not near, so all of its voxels are on one side.
      const std::uint32_t i[3] = {(brick[0] + upper[0]) * kBrickEdge, (brick[1] + upper[1]) * kBrickEdge,
                                  (brick[2] + upper[2]) * kBrickEdge};
      const bool within =
          i[0] < grid_.dims[0] && i[1] < grid_.dims[1] && i[2] < grid_.dims[2] && runs_.test(grid_, i[0], i[1], i[2]);
      for (std::size_t z = 0; z < count[2]; ++z) {
        for (std::size_t y = 0; y < count[1]; ++y) {
          std::fill_n(value_.data() + row_at(y, z), count[0], within ? field_.band_inner : -field_.band_outer);
          std::fill_n(closest_.data() + row_at(y, z), count[0], kNoTriangle);
        }
      }
      continue;
    }
    for (std::size_t z = 0; z < count[2]; ++z) {
      const PlaneRows rows(field_, stored, z);
      for (std::size_t y = 0; y < count[1]; ++y) {
        const std::size_t to = row_at(y, z);
        std::size_t from = rows.begin(y);
        if (count[0] == kBrickEdge && rows.all(y)) {
          std::copy_n(field_.penetration.data() + from, kBrickEdge, value_.data() + to);
          std::copy_n(field_.closest.data() + from, kBrickEdge, closest_.data() + to);
          continue;
        }
        for (std::size_t x = 0; x < count[0]; ++x) {
          const bool exact = rows.has(y, static_cast<int>(x));
          const bool within = (field_.inside[stored][z] >> (8 * y + x) & 1) != 0;
          value_[to + x] = exact ? field_.penetration[from] : within ? field_.band_inner : -field_.band_outer;
          closest_[to + x] = exact ? field_.closest[from] : kNoTriangle;
          from += exact ? 1 : 0;
        }
      }
    }
  }
}

// Values from three voxels before the brick to three behind its samples, unknown beyond the band.
void OctantSamples::load_lines() {
  constexpr auto kEdge = static_cast<int>(kBrickEdge);
  constexpr int kEnd = kSide + kHalo;
  const auto per_voxel = static_cast<float>(1 / grid_.voxel_size);
  const auto converted = [&](std::size_t place) { return static_cast<float>(field_.penetration[place]) * per_voxel; };
  for (int z = -kHalo; z < kEnd; ++z) {
    const bool z_out = z < 0 || z >= kSide;
    float plane[kSide][kHalo + kEnd];  // rows of the octant's samples
    for (int brick_y = -1; brick_y <= 1; ++brick_y) {
      PlaneRows rows[3];
      for (std::size_t n = 0; n < 3; ++n) {
        const std::uint32_t stored = bricks_[static_cast<std::size_t>(((z + kEdge) / kEdge * 3 + brick_y + 1) * 3) + n];
        if (stored != kNoBrick) rows[n] = {field_, stored, static_cast<std::size_t>((z + kEdge) % kEdge)};
      }
      const int first = std::max(brick_y * kEdge, z_out ? 0 : -kHalo);
      const int end = std::min((brick_y + 1) * kEdge, z_out ? kSide : kEnd);
      for (int y = first; y < end; ++y) {
        const auto at = static_cast<std::size_t>(y - brick_y * kEdge);
        const bool y_out = y < 0 || y >= kSide;
        float beside[kHalo + kEnd];
        float* const row = y_out ? beside : plane[y];
        std::size_t place = rows[0].end(at);
        for (int x = kHalo - 1; x >= 0; --x) {
          row[x] = rows[0].has(at, kEdge - kHalo + x) ? converted(--place) : kUnknown;
        }
        place = rows[1].begin(at);
        if (rows[1].all(at)) {
          for (int x = 0; x < kEdge; ++x) row[kHalo + x] = converted(place + static_cast<std::size_t>(x));
        } else {
          for (int x = 0; x < kEdge; ++x) row[kHalo + x] = rows[1].has(at, x) ? converted(place++) : kUnknown;
        }
        place = rows[2].begin(at);
        for (int x = 0; x <= kHalo; ++x) {
          row[kHalo + kEdge + x] = rows[2].has(at, x) ? converted(place++) : kUnknown;
        }
        if (!z_out) std::copy_n(row + kHalo, kSide, &lines_.value[1][y + kHalo][line_of(1, 0, y, z)]);
        if (!y_out) std::copy_n(row + kHalo, kSide, &lines_.value[2][z + kHalo][line_of(2, 0, y, z)]);
      }
    }
    if (z_out) continue;
    for (int x = 0; x < kHalo + kEnd; ++x) {
      for (int y = 0; y < kSide; ++y) lines_.value[0][x][line_of(0, 0, y, z)] = plane[y][x];
    }
  }
}

void OctantSamples::estimate() {
  load_lines();
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

std::array<float, 125> OctantSamples::shifts_of_two() const {
  constexpr float kShare = 0.425F;
  constexpr int kPlane = kSide * kSide;
  constexpr int kPlaces = (kSide + 1) / 2;
  float along[3][kPlaces][kPlane];
  for (int axis = 0; axis < 3; ++axis) {
    for (int place = 0; place < kPlaces; ++place) {
      const auto* const here = lines_.value[axis] + kHalo + 2 * place;
      for (int line = 0; line < kPlane; ++line) {
        const float before = (here[0][line] + here[-2][line]) / 2 - here[-1][line];
        const float after = (here[0][line] + here[2][line]) / 2 - here[1][line];
        along[axis][place][line] = both_ways(std::isnan(before) ? 0.0F : before, std::isnan(after) ? 0.0F : after);
      }
    }
  }
  std::array<float, 125> shifts;
  std::size_t n = 0;
  for (int z = 0; z < kPlaces; ++z) {
    for (int y = 0; y < kPlaces; ++y) {
      for (int x = 0; x < kPlaces; ++x) {
        const float sum = 0 + along[0][x][line_of(0, 2 * x, 2 * y, 2 * z)] +
                          along[1][y][line_of(1, 2 * x, 2 * y, 2 * z)] + along[2][z][line_of(2, 2 * x, 2 * y, 2 * z)];
        shifts[n++] = -kShare * sum;
      }
    }
  }
  return shifts;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/coarse_layers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace vps::bake {
namespace {

// Lengths in half voxels: voxel i is centred at 2 i + 1, brick b at 16 b + 8.
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kBrickHalves = 2 * static_cast<int>(kBrickEdge);

// Squared distance from each brick's centre along x to the nearest surface voxel of the row; `row` holds 8 bits per
// brick.
void nearest_in_row(const std::vector<std::uint8_t>& row, float* out) {
  const auto bricks = static_cast<int>(row.size());
  constexpr int kNone = 1 << 28;
  int last = -kNone;
  for (int b = 0; b < bricks; ++b) {
    const int centre = kBrickHalves * b + kBrickHalves / 2;
    const auto bits = std::uint32_t{row[static_cast<std::size_t>(b)]};
    const std::uint32_t below = bits & 0xF;
    if (below != 0) last = kBrickHalves * b + 2 * (std::bit_width(below) - 1) + 1;
    const auto d = static_cast<float>(centre - last);
    out[b] = last < 0 ? kFar : d * d;
    if (bits >> 4 != 0) last = kBrickHalves * b + 2 * (std::bit_width(bits) - 1) + 1;
  }
  int next = kNone;
  for (int b = bricks - 1; b >= 0; --b) {
    const int centre = kBrickHalves * b + kBrickHalves / 2;
    const auto bits = std::uint32_t{row[static_cast<std::size_t>(b)]};
    const std::uint32_t above = bits & 0xF0;
    if (above != 0) next = kBrickHalves * b + 2 * std::countr_zero(above) + 1;
    const auto d = static_cast<float>(next - centre);
    if (next < kNone) out[b] = std::min(out[b], d * d);
    if ((bits & 0xF) != 0) next = kBrickHalves * b + 2 * std::countr_zero(bits) + 1;
  }
}

// min over i of values[i] + (distance of voxel i to the brick's centre)^2, for every brick of a line.
class Envelope {
 public:
  // Calls out(brick, minimum).
  template <class Values, class Out>
  void lower(int count, Values values, int bricks, Out out) {
    parabolas_.clear();
    for (int i = 0; i < count; ++i) {
      const double value = values(i);
      if (value == kFar) continue;
      const double at = 2 * i + 1;
      double from = -std::numeric_limits<double>::infinity();
      while (!parabolas_.empty()) {
        const Parabola& p = parabolas_.back();
        from = (value + at * at - (p.value + p.at * p.at)) / (2 * (at - p.at));
        if (from > p.from) break;
        parabolas_.pop_back();
      }
      if (parabolas_.empty()) from = -std::numeric_limits<double>::infinity();
      parabolas_.push_back({at, value, from});
    }
    std::size_t p = 0;
    for (int b = 0; b < bricks; ++b) {
      const double centre = kBrickHalves * (b + 0.5);
      if (parabolas_.empty()) {
        out(b, kFar);
        continue;
      }
      while (p + 1 < parabolas_.size() && parabolas_[p + 1].from <= centre) ++p;
      const double d = centre - parabolas_[p].at;
      out(b, static_cast<float>(parabolas_[p].value + d * d));
    }
  }

 private:
  struct Parabola {
    double at, value, from;
  };
  std::vector<Parabola> parabolas_;
};

// Squared distances over x and y for one slice of voxels. `plane` holds a value per brick column, [by][bx].
void slice_distances(const Grid& grid, const SurfaceVoxels& voxels, std::uint32_t k, float* plane) {
  const std::uint32_t bx = grid.brick_dims[0];
  std::vector<float> rows(std::size_t{grid.dims[1]} * bx, kFar);
  std::vector<std::uint8_t> row(bx);
  for (std::uint32_t j = 0; j < grid.dims[1]; ++j) {
    bool any = false;
    for (std::uint32_t b = 0; b < bx; ++b) {
      const std::uint32_t brick = voxels.set.index[grid.brick_at(b, j / kBrickEdge, k / kBrickEdge)];
      row[b] = brick == kNoBrick ? std::uint8_t{0}
                                 : static_cast<std::uint8_t>(voxels.masks[brick][k % kBrickEdge] >> (8 * (j % 8)));
      any = any || row[b] != 0;
    }
    if (any) nearest_in_row(row, rows.data() + std::size_t{j} * bx);
  }
  Envelope envelope;
  for (std::uint32_t b = 0; b < bx; ++b) {
    envelope.lower(
        static_cast<int>(grid.dims[1]), [&](int j) { return rows[static_cast<std::size_t>(j) * bx + b]; },
        static_cast<int>(grid.brick_dims[1]), [&](int y, float d) { plane[static_cast<std::size_t>(y) * bx + b] = d; });
  }
}

}  // namespace

std::vector<std::int16_t> coarse_layers(const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs) {
  const std::size_t plane = std::size_t{grid.brick_dims[0]} * grid.brick_dims[1];
  std::vector<float> slices(plane * grid.dims[2]);
  tbb::parallel_for(std::uint32_t{0}, grid.dims[2],
                    [&](std::uint32_t k) { slice_distances(grid, voxels, k, slices.data() + plane * k); });
  std::vector<std::int16_t> layers(grid.brick_count(), 0);
  tbb::parallel_for(std::uint32_t{0}, grid.brick_dims[1], [&](std::uint32_t y) {
    Envelope envelope;
    for (std::uint32_t x = 0; x < grid.brick_dims[0]; ++x) {
      const std::size_t column = std::size_t{y} * grid.brick_dims[0] + x;
      envelope.lower(
          static_cast<int>(grid.dims[2]), [&](int k) { return slices[plane * static_cast<std::size_t>(k) + column]; },
          static_cast<int>(grid.brick_dims[2]),
          [&](int b, float squared) {
            const auto z = static_cast<std::uint32_t>(b);
            const std::size_t at = grid.brick_at(x, y, z);
            // Squares were rounded to float.
            const double halves = std::sqrt(static_cast<double>(squared)) * (1 - 1e-6);
            const double voxels_away = std::floor(halves / 2 - std::sqrt(0.75));
            const auto layer = static_cast<std::int16_t>(std::clamp(voxels_away, 0.0, 32767.0));
            // A brick without surface lies on one side, so any of its voxels gives the sign.
            layers[at] = runs.test(grid, x * 8 + 4, y * 8 + 4, z * 8 + 4) ? layer : static_cast<std::int16_t>(-layer);
          });
    }
  });
  return layers;
}

}  // namespace vps::bake

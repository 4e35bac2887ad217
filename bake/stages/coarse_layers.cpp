// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/coarse_layers.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace vps::bake {
namespace {

// Lengths in half voxels: voxel i is centred at 2 i + 1, block b of edge e at 2 e b + e. The centre of a block lies in
// the middle of a brick or between bricks.
constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kBrickHalves = 2 * static_cast<int>(kBrickEdge);

// The surface voxels of a brick in a row along x.
struct RowBits {
  int brick;
  std::uint32_t bits;  // 8, not all 0
  [[nodiscard]] int first() const { return kBrickHalves * brick + 2 * std::countr_zero(bits) + 1; }
  [[nodiscard]] int last() const { return kBrickHalves * brick + 2 * width(bits) - 1; }
  [[nodiscard]] int nearest_to_centre() const {
    return std::min(9 - 2 * width(bits & 0xF), 2 * std::countr_zero(bits >> 4) + 1);
  }

 private:
  static int width(std::uint32_t x) { return static_cast<int>(std::bit_width(x)); }
};

// Squared distance from the centres of blocks [begin, end) along x to the nearest surface voxel of the row.
// @param row  not empty
void nearest_in_row(const std::vector<RowBits>& row, int edge, int begin, int end, float* out) {
  constexpr int kNone = std::numeric_limits<int>::max();
  std::size_t n = 0;
  for (int b = begin; b < end; ++b) {
    const int centre = 2 * edge * b + edge;
    while (n < row.size() && kBrickHalves * (row[n].brick + 1) <= centre) ++n;
    const int before = n > 0 ? centre - row[n - 1].last() : kNone;
    const int after = n < row.size() ? row[n].first() - centre : kNone;
    const bool is_here = n < row.size() && kBrickHalves * row[n].brick < centre;
    const auto distance = static_cast<float>(is_here ? row[n].nearest_to_centre() : std::min(before, after));
    *out++ = distance * distance;
  }
}

// min over i of values[i] + (distance of voxel i to the block's centre)^2, for every block of a line.
class Envelope {
 public:
  // Calls out(block, minimum).
  template <class Values, class Out>
  void lower(int count, Values values, int edge, int blocks, Out out) {
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
    for (int b = 0; b < blocks; ++b) {
      const double centre = 2 * edge * (b + 0.5);
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

// Works on some of the blocks along x at a time: then the distances of all slices of voxels take little memory, and
// those of one slice stay in the processor's cache.
constexpr std::uint32_t kPart = 32;

class CoarseLayers {
 public:
  CoarseLayers(const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs, std::uint32_t edge)
      : grid_(grid), voxels_(voxels), runs_(runs), edge_(edge), row_start_(rows() + 1, 0) {
    for (std::size_t axis = 0; axis < 3; ++axis) blocks_[axis] = (grid.dims[axis] + edge - 1) / edge;
    layers_.resize(std::size_t{blocks_[0]} * blocks_[1] * blocks_[2]);
    for (const Index3& b : voxels.set.bricks) ++row_start_[row(b[1], b[2]) + 1];
    for (std::size_t r = 0; r < rows(); ++r) row_start_[r + 1] += row_start_[r];
  }

  [[nodiscard]] std::vector<std::int16_t> measure() {
    for (std::uint32_t begin = 0; begin < blocks_[0]; begin += kPart) {
      measure_part(begin, std::min(begin + kPart, blocks_[0]));
    }
    return std::move(layers_);
  }

 private:
  // Sets the layers of blocks [begin, end) along x.
  void measure_part(std::uint32_t begin, std::uint32_t end) {
    const std::size_t width = end - begin;
    const std::size_t plane = width * blocks_[1];
    std::vector<float> slices(plane * grid_.dims[2]);
    tbb::parallel_for(std::uint32_t{0}, grid_.dims[2],
                      [&](std::uint32_t k) { slice_distances(k, begin, end, slices.data() + plane * k); });
    tbb::parallel_for(std::uint32_t{0}, blocks_[1], [&](std::uint32_t y) {
      Envelope envelope;
      for (std::uint32_t x = begin; x < end; ++x) {
        const std::size_t column = y * width + x - begin;
        envelope.lower(
            static_cast<int>(grid_.dims[2]),
            [&](int k) { return slices[plane * static_cast<std::size_t>(k) + column]; }, static_cast<int>(edge_),
            static_cast<int>(blocks_[2]),
            [&](int b, float squared) { set_layer(x, y, static_cast<std::uint32_t>(b), squared); });
      }
    });
  }

  [[nodiscard]] std::size_t rows() const { return std::size_t{grid_.brick_dims[1]} * grid_.brick_dims[2]; }
  [[nodiscard]] std::size_t row(std::uint32_t y, std::uint32_t z) const { return z * grid_.brick_dims[1] + y; }

  // Squared distances over x and y for one slice of voxels. `plane` holds a value per column of blocks, [y][x].
  void slice_distances(std::uint32_t k, std::uint32_t begin, std::uint32_t end, float* plane) const {
    const std::size_t width = end - begin;
    std::vector<float> distances(width * grid_.dims[1], kFar);
    std::vector<RowBits> bits;
    for (std::uint32_t j = 0; j < grid_.dims[1]; ++j) {
      const std::size_t r = row(j / kBrickEdge, k / kBrickEdge);
      bits.clear();
      for (std::uint32_t n = row_start_[r]; n < row_start_[r + 1]; ++n) {
        const auto byte = static_cast<std::uint8_t>(voxels_.masks[n][k % kBrickEdge] >> (8 * (j % 8)));
        if (byte != 0) bits.push_back({static_cast<int>(voxels_.set.bricks[n][0]), byte});
      }
      if (bits.empty()) continue;
      nearest_in_row(bits, static_cast<int>(edge_), static_cast<int>(begin), static_cast<int>(end),
                     distances.data() + j * width);
    }
    Envelope envelope;
    for (std::size_t b = 0; b < width; ++b) {
      envelope.lower(
          static_cast<int>(grid_.dims[1]), [&](int j) { return distances[static_cast<std::size_t>(j) * width + b]; },
          static_cast<int>(edge_), static_cast<int>(blocks_[1]),
          [&](int y, float d) { plane[static_cast<std::size_t>(y) * width + b] = d; });
    }
  }

  // @param squared  distance of the nearest surface voxel's centre from the block's, in half voxels
  void set_layer(std::uint32_t x, std::uint32_t y, std::uint32_t z, float squared) {
    // Squares were rounded to float.
    const double halves = std::sqrt(static_cast<double>(squared)) * (1 - 1e-6);
    const double voxels_away = std::floor(halves / 2 - std::sqrt(0.75));
    const auto layer = static_cast<std::int16_t>(std::clamp(voxels_away, 0.0, 32767.0));
    // A block without surface lies on one side, so any of its voxels gives the sign.
    const auto voxel = [&](std::uint32_t block, std::size_t axis) {
      return std::min(block * edge_ + edge_ / 2, grid_.dims[axis] - 1);
    };
    const bool inside = runs_.test(grid_, voxel(x, 0), voxel(y, 1), voxel(z, 2));
    layers_[(std::size_t{z} * blocks_[1] + y) * blocks_[0] + x] = inside ? layer : static_cast<std::int16_t>(-layer);
  }

  const Grid& grid_;
  const SurfaceVoxels& voxels_;
  const InsideRuns& runs_;
  const std::uint32_t edge_;
  Index3 blocks_{};
  std::vector<std::uint32_t> row_start_;  // of each row of bricks along x: its first brick with surface
  std::vector<std::int16_t> layers_;
};

}  // namespace

std::vector<std::int16_t> coarse_layers(const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs,
                                        std::uint32_t edge) {
  return CoarseLayers(grid, voxels, runs, edge).measure();
}

}  // namespace vps::bake

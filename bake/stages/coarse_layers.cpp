// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/coarse_layers.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace vps::bake {
namespace {

// Lengths in half voxels: voxel i is centred at 2 i + 1, block b of edge e at 2 e b + e. The centre of a block lies in
// the middle of a brick or between bricks.
constexpr int kFar = 1 << 30;  // squared; more than any distance in a grid
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
void nearest_in_row(const std::vector<RowBits>& row, int edge, int begin, int end, int* out) {
  constexpr int kNone = 1 << 20;  // halves; beyond every grid
  int b = begin;
  const auto centre = [&](int block) { return 2 * edge * block + edge; };
  // Blocks with their centre up to the next brick lie between two voxels.
  const auto fill_gap = [&](int before, int after, int last_centre) {
    const int stop = std::min(end, last_centre >= edge ? (last_centre - edge) / (2 * edge) + 1 : 0);
    for (; b < stop; ++b) {
      const int distance = std::min(centre(b) - before, after - centre(b));
      *out++ = distance * distance;
    }
  };
  int before = -kNone;
  for (const RowBits& bits : row) {
    fill_gap(before, bits.first(), kBrickHalves * bits.brick);
    for (; b < end && centre(b) < kBrickHalves * (bits.brick + 1); ++b) {
      const int distance = bits.nearest_to_centre();
      *out++ = distance * distance;
    }
    before = bits.last();
  }
  fill_gap(before, kNone, kNone);
}

// Works on some of the blocks along x at a time: then the distances of all slices of voxels take little memory, and
// those of one slice stay in the processor's cache.
constexpr std::uint32_t kPart = 32;

// Neighbouring blocks along x, which a processor compares at once.
constexpr std::uint32_t kLanes = 8;
using Lanes = Eigen::Array<int, kLanes, 1>;
static_assert(kPart % kLanes == 0);

// The voxels of a line along y or z, with squared distances across it for each lane.
struct Line {
  const int* first;
  std::size_t stride;
  int count;
  [[nodiscard]] Eigen::Map<const Lanes> at(int voxel) const {
    return Eigen::Map<const Lanes>(first + stride * static_cast<std::size_t>(voxel));
  }
};

// Adds the distances along a line: the least sum of squares for the centre of every block.
class LineMinimum {
 public:
  // Calls out(block, Lanes).
  template <class Out>
  void find(const Line& line, int edge, int blocks, Out out) {
    least_.clear();
    for (int b = 0; b < blocks; ++b) {
      Lanes least = Lanes::Constant(kFar);
      for (int i = edge * b; i < std::min(edge * (b + 1), line.count); ++i) least = least.min(line.at(i));
      least_.push_back(least);
    }
    for (int b = 0; b < blocks; ++b) out(b, nearest(line, edge, b));
  }

 private:
  // Looks at the voxels of block after block, away from the centre, as long as there may be a nearer one.
  [[nodiscard]] Lanes nearest(const Line& line, int edge, int b) const {
    Lanes best = Lanes::Constant(kFar);
    const int blocks = static_cast<int>(least_.size());
    const auto look_at = [&](int block, int gap) {
      if (block < 0 || block >= blocks || !(least_[static_cast<std::size_t>(block)] + gap * gap < best).any()) return;
      const int end = std::min(edge * (block + 1), line.count);
      for (int i = edge * block; i < end; ++i) {
        const int along = 2 * i + 1 - (2 * edge * b + edge);
        best = best.min(line.at(i) + along * along);
      }
    };
    look_at(b, 0);
    for (int step = 1; step < blocks; ++step) {
      const int gap = edge * (2 * step - 1) + 1;
      if (gap * gap >= best.maxCoeff()) break;
      look_at(b - step, gap);
      look_at(b + step, gap);
    }
    return best;
  }

  std::vector<Lanes> least_;  // of each block's voxels
};

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
    // The last lanes may lie beyond the grid.
    const std::uint32_t end = (blocks_[0] + kLanes - 1) / kLanes * kLanes;
    for (std::uint32_t begin = 0; begin < end; begin += kPart) measure_part(begin, std::min(begin + kPart, end));
    return std::move(layers_);
  }

 private:
  // Sets the layers of blocks [begin, end) along x.
  void measure_part(std::uint32_t begin, std::uint32_t end) {
    const std::size_t plane = kPart * std::size_t{blocks_[1]};
    std::vector<int> slices(plane * grid_.dims[2]);
    tbb::parallel_for(std::uint32_t{0}, grid_.dims[2],
                      [&](std::uint32_t k) { slice_distances(k, begin, end, slices.data() + plane * k); });
    tbb::parallel_for(std::uint32_t{0}, blocks_[1], [&](std::uint32_t y) {
      LineMinimum minimum;
      for (std::uint32_t x = begin; x < end; x += kLanes) {
        const Line line{slices.data() + y * kPart + x - begin, plane, static_cast<int>(grid_.dims[2])};
        minimum.find(line, static_cast<int>(edge_), static_cast<int>(blocks_[2]), [&](int b, const Lanes& squared) {
          for (std::uint32_t lane = 0; lane < std::min(kLanes, blocks_[0] - x); ++lane) {
            set_layer(x + lane, y, static_cast<std::uint32_t>(b), squared[lane]);
          }
        });
      }
    });
  }

  [[nodiscard]] std::size_t rows() const { return std::size_t{grid_.brick_dims[1]} * grid_.brick_dims[2]; }
  [[nodiscard]] std::size_t row(std::uint32_t y, std::uint32_t z) const { return z * grid_.brick_dims[1] + y; }

  // Squared distances over x and y for one slice of voxels. `plane` holds a value per column of blocks, [y][x].
  void slice_distances(std::uint32_t k, std::uint32_t begin, std::uint32_t end, int* plane) const {
    std::vector<int> distances(kPart * std::size_t{grid_.dims[1]}, kFar);
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
                     distances.data() + std::size_t{j} * kPart);
    }
    LineMinimum minimum;
    for (std::size_t x = 0; x < end - begin; x += kLanes) {
      minimum.find({distances.data() + x, kPart, static_cast<int>(grid_.dims[1])}, static_cast<int>(edge_),
                   static_cast<int>(blocks_[1]), [&](int y, const Lanes& squared) {
                     Eigen::Map<Lanes>(plane + static_cast<std::size_t>(y) * kPart + x) = squared;
                   });
    }
  }

  // @param squared  distance of the nearest surface voxel's centre from the block's, in half voxels
  void set_layer(std::uint32_t x, std::uint32_t y, std::uint32_t z, int squared) {
    const double halves = std::sqrt(static_cast<double>(squared)) * (1 - 1e-6);  // rounding must not lengthen it
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

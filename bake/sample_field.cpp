// SPDX-License-Identifier: GPL-3.0-or-later
// From the coarsest bricks down: a finer brick is kept where its samples differ from the coarser one's interpolation.
#include "bake/sample_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/nearest_triangle.h"

namespace vps {
namespace {

constexpr int kEdge = kFieldEdge;
constexpr int kSamples = kEdge * kEdge * kEdge;
constexpr int kCells = kEdge - 1;
const double kHalfDiagonal = std::sqrt(0.75);

using Index = std::array<std::int32_t, 3>;

constexpr int sample_at(int x, int y, int z) {
  return (z * kEdge + y) * kEdge + x;
}

// Places are counted in quarter voxels from the centre of voxel (0,0,0), so that those of every level are whole.
constexpr std::int32_t kQuarters = 4;
constexpr std::int32_t step_of(int level) {
  return level >= 0 ? kQuarters << level : kQuarters >> -level;
}

struct Brick {
  int level = 0;
  Index base{};
  std::array<double, kSamples> value;
  std::array<std::uint32_t, kSamples> closest;
  std::uint32_t entry = kFarOutside;  // once it is stored
};

// What one block of the octree adds to the whole, numbered from 0.
struct Block {
  std::uint32_t root = kFarOutside;
  std::vector<std::uint32_t> nodes;
  std::vector<std::int8_t> levels;
  std::vector<double> penetration;
  std::vector<float> gradient;
  double worst_error = 0;
  Vector worst_at = Vector::Zero();
};

class BlockSampler {
 public:
  BlockSampler(const Surface& surface, const Grid& grid, const InsideRuns& runs, const BandField& field,
               const InsideTest& inside, const FieldTolerance& tolerance, bool with_gradient)
      : surface_(surface),
        grid_(grid),
        runs_(runs),
        field_(field),
        inside_(inside),
        tolerance_(tolerance),
        with_gradient_(with_gradient),
        reach_(std::max(field.band_inner, field.band_outer) - kHalfDiagonal * grid.voxel_size) {}

  Block sample(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    block_ = {};
    const auto node = open_node();
    for (std::uint32_t octant = 0; octant < 8; ++octant) {
      const std::uint32_t bricks[3] = {2 * x + (octant & 1), 2 * y + (octant >> 1 & 1), 2 * z + (octant >> 2)};
      block_.nodes[node + octant] = sample_octant(bricks);
    }
    block_.root = close_node(node);
    return std::move(block_);
  }

 private:
  Vector place(const Index& at) const { return grid_.centre(0, 0, 0) + quarter() * Vector(at[0], at[1], at[2]); }
  double quarter() const { return grid_.voxel_size / kQuarters; }

  // The cells between the centres of a voxel brick and of its upper neighbours.
  std::uint32_t sample_octant(const std::uint32_t (&at)[3]) {
    bool near = false;
    for (std::uint32_t corner = 0; corner < 8 && !near; ++corner) {
      const std::uint32_t b[3] = {at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2)};
      near = b[0] < grid_.brick_dims[0] && b[1] < grid_.brick_dims[1] && b[2] < grid_.brick_dims[2] &&
             field_.set.index[grid_.brick_at(b[0], b[1], b[2])] != kNoBrick;
    }
    const Index base = {static_cast<std::int32_t>(at[0] * kBrickEdge) * kQuarters,
                        static_cast<std::int32_t>(at[1] * kBrickEdge) * kQuarters,
                        static_cast<std::int32_t>(at[2] * kBrickEdge) * kQuarters};
    if (near) near = any_in_band(base);
    if (!near) return voxel(base).value > 0 ? kFarInside : kFarOutside;
    Brick brick = sample_voxels(kCoarsestLevel, base);
    return divide(brick);
  }

  struct Sample {
    double value;
    std::uint32_t closest;
  };
  Sample voxel(const Index& at) const {
    std::uint32_t i[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      i[axis] = static_cast<std::uint32_t>(at[axis] / kQuarters);
      if (i[axis] >= grid_.dims[axis]) return {-field_.band_outer, kNoTriangle};
    }
    const std::uint32_t brick = field_.set.index[grid_.brick_of_voxel(i[0], i[1], i[2])];
    if (brick == kNoBrick) {
      return {runs_.test(grid_, i[0], i[1], i[2]) ? field_.band_inner : -field_.band_outer, kNoTriangle};
    }
    const std::size_t n = field_.at(brick, voxel_in_brick(i[0], i[1], i[2]));
    return {field_.penetration[n], field_.closest[n]};
  }

  bool any_in_band(const Index& base) const {
    constexpr auto kSpan = static_cast<std::int32_t>(kBrickEdge);
    for (std::int32_t z = 0; z <= kSpan; ++z) {
      for (std::int32_t y = 0; y <= kSpan; ++y) {
        for (std::int32_t x = 0; x <= kSpan; ++x) {
          const double v = voxel({base[0] + x * kQuarters, base[1] + y * kQuarters, base[2] + z * kQuarters}).value;
          if (v <= tolerance_.band_inner && v >= -tolerance_.band_outer) return true;
        }
      }
    }
    return false;
  }

  Brick sample_voxels(int level, const Index& base) const {
    Brick brick{level, base, {}, {}};
    const std::int32_t step = step_of(level);
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const Sample found = voxel({base[0] + x * step, base[1] + y * step, base[2] + z * step});
          brick.value[static_cast<std::size_t>(sample_at(x, y, z))] = found.value;
          brick.closest[static_cast<std::size_t>(sample_at(x, y, z))] = found.closest;
        }
      }
    }
    return brick;
  }

  // Triangles that can be closest to a point of a cube, and the largest distance that such a point can have.
  struct Candidates {
    std::vector<std::uint32_t> triangles;
    double reach = 0;  // [m]
  };
  // @param edge  of the cube above `base`, in quarters
  Candidates closest_candidates(std::span<const std::uint32_t> from, const Index& base, std::int32_t edge) const {
    const Vector centre = place(base) + Vector::Constant(quarter() * edge / 2);
    const double radius = kHalfDiagonal * quarter() * edge;
    std::vector<double> squared(from.size());
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < from.size(); ++i) {
      const std::uint32_t t = from[i];
      const Vector near =
          closest_on_triangle(centre, surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2));
      squared[i] = (near - centre).squaredNorm();
      least = std::min(least, squared[i]);
    }
    const double limit = (std::sqrt(least) + 2 * radius) * (1 + 1e-9);
    Candidates kept;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (squared[i] <= limit * limit) kept.triangles.push_back(from[i]);
    }
    kept.reach = std::min((std::sqrt(least) + radius) * (1 + 1e-9), reach_);
    return kept;
  }

  // The brick half as large over an octant of `parent`, between voxel centres.
  Brick sample_between(const Brick& parent, int octant, const Candidates& candidates) const {
    Brick brick{parent.level - 1, octant_base(parent, octant), {}, {}};
    const PointLattice points{place(brick.base), quarter() * step_of(brick.level), kEdge};
    NearestTriangles nearest;
    nearest.squared.fill(candidates.reach * candidates.reach);
    nearest.triangle.fill(-1);
    for (const std::uint32_t t : candidates.triangles) {
      offer_triangle(surface_, t, points, candidates.reach, nearest);
    }
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const auto at = static_cast<std::size_t>(sample_at(x, y, z));
          const auto around = [&](int corner) {
            return static_cast<std::size_t>(sample_at(2 * (octant & 1) + (x + (corner & 1)) / 2,
                                                      2 * (octant >> 1 & 1) + (y + (corner >> 1 & 1)) / 2,
                                                      2 * (octant >> 2) + (z + (corner >> 2)) / 2));
          };
          const int odd = (x & 1) + (y & 1) + (z & 1);
          if (odd == 0) {
            brick.value[at] = parent.value[around(0)];
            brick.closest[at] = parent.closest[around(0)];
            continue;
          }
          const Vector p = points.first + points.step * Vector(x, y, z);
          const double found = nearest.triangle[static_cast<std::size_t>((z * 8 + y) * 8 + x)];
          double distance = reach_;
          brick.closest[at] = kNoTriangle;
          if (found >= 0) {
            const auto t = static_cast<std::uint32_t>(found);
            const Vector near =
                closest_on_triangle(p, surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2));
            distance = std::min((near - p).norm(), reach_);
            brick.closest[at] = t;
          }
          // The surface cannot pass between two points that are nearer to each other than it is to both together.
          double surest = 0;
          for (int corner = 0; corner < 8; ++corner) {
            const double known = parent.value[around(corner)];
            if (std::abs(known) > std::abs(surest)) surest = known;
          }
          const bool known_side = distance + std::abs(surest) > points.step * std::sqrt(odd) * (1 + 1e-9);
          const bool within = known_side ? surest > 0 : inside_.inside(p);
          brick.value[at] = within ? distance : -distance;
        }
      }
    }
    return brick;
  }

  static Index octant_base(const Brick& parent, int octant) {
    const std::int32_t half = step_of(parent.level) * kCells / 2;
    return {parent.base[0] + (octant & 1) * half, parent.base[1] + (octant >> 1 & 1) * half,
            parent.base[2] + (octant >> 2) * half};
  }

  // Largest error that interpolation may have where the penetration is v.
  double allowed(double v) const {
    const double band = v > 0 ? tolerance_.band_inner : tolerance_.band_outer;
    const double core = band - kHalfDiagonal * grid_.voxel_size;
    constexpr double kGrowth = 0.25;
    const double depth = std::abs(v);
    if (depth <= core) return tolerance_.error;
    return depth <= band ? tolerance_.error + kGrowth * (depth - core) : std::numeric_limits<double>::infinity();
  }

  // Whether an octant may hold an error worth looking for. A crease between two samples of a line bends it by a at one
  // end and b at the other; interpolation errs by a b / (a + b) there, and in space by no more than the sum over the
  // axes. That is twice too much for nearly all cells: on a scan, 2 of 6700 bad octants had less.
  bool is_suspect(const Brick& brick, int octant) const {
    const int low[3] = {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
    const int stride[3] = {1, kEdge, kEdge * kEdge};
    const auto value = [&](int n) { return brick.value[static_cast<std::size_t>(n)]; };
    const double cell_edge = quarter() * step_of(brick.level);
    const double core = std::max(tolerance_.band_inner, tolerance_.band_outer) - kHalfDiagonal * grid_.voxel_size;
    for (int cell = 0; cell < 8; ++cell) {
      const int index[3] = {low[0] + (cell & 1), low[1] + (cell >> 1 & 1), low[2] + (cell >> 2)};
      const int at = sample_at(index[0], index[1], index[2]);
      double error = 0;
      double nearest = std::numeric_limits<double>::infinity();
      for (int axis = 0; axis < 3; ++axis) {
        const int along = stride[axis];
        const int across[2] = {stride[(axis + 1) % 3], stride[(axis + 2) % 3]};
        double largest = 0;
        for (int edge = 0; edge < 4; ++edge) {
          const int n = at + (edge & 1) * across[0] + (edge >> 1) * across[1];
          const double rise = value(n + along) - value(n);
          nearest = std::min(nearest, std::abs(value(n)));
          // At the brick's end the bend beyond is not known.
          const double a = index[axis] > 0 ? std::abs(rise - (value(n) - value(n - along))) : -1;
          const double b = index[axis] + 1 < kCells ? std::abs(value(n + 2 * along) - value(n + along) - rise) : -1;
          largest = std::max(largest, a < 0 ? b : b < 0 ? a : a + b > 0 ? a * b / (a + b) : 0);
        }
        error += largest;
      }
      constexpr double kTooMuch = 2;
      if (error > kTooMuch * tolerance_.error && nearest <= core + kHalfDiagonal * cell_edge) return true;
    }
    return false;
  }

  // Whether the coarser brick's interpolation will do at the finer one's samples.
  bool will_do(const Brick& coarse, int octant, const Brick& fine) {
    const int low[3] = {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
    bool good = true;
    double worst = 0;
    int worst_at = 0;
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          double sum = 0;
          for (int corner = 0; corner < 8; ++corner) {
            const int cx = low[0] + (x + (corner & 1)) / 2;
            const int cy = low[1] + (y + (corner >> 1 & 1)) / 2;
            const int cz = low[2] + (z + (corner >> 2)) / 2;
            sum += coarse.value[static_cast<std::size_t>(sample_at(cx, cy, cz))];
          }
          const int at = sample_at(x, y, z);
          const double truth = fine.value[static_cast<std::size_t>(at)];
          const double error = std::abs(sum / 8 - truth);
          const double limit = allowed(truth);
          good = good && error <= limit;
          if (limit == tolerance_.error && error > worst) {
            worst = error;
            worst_at = at;
          }
        }
      }
    }
    if (good && worst > block_.worst_error) {
      block_.worst_error = worst;
      const std::int32_t step = step_of(fine.level);
      block_.worst_at = place({fine.base[0] + worst_at % kEdge * step, fine.base[1] + worst_at / kEdge % kEdge * step,
                               fine.base[2] + worst_at / (kEdge * kEdge) * step});
    }
    return good;
  }

  // The entry of a brick: its own where it will do everywhere, else a node.
  std::uint32_t divide(Brick& brick) {
    if (brick.level == kFinestLevel) return store(brick);
    Candidates candidates;
    const auto node = open_node();
    for (int octant = 0; octant < 8; ++octant) {
      std::uint32_t entry = kFarOutside;
      if (brick.level > 0) {
        Brick fine = sample_voxels(brick.level - 1, octant_base(brick, octant));
        entry = will_do(brick, octant, fine) ? store(brick) : divide(fine);
      } else if (is_suspect(brick, octant)) {
        if (candidates.triangles.empty())
          candidates = closest_candidates(listed(brick), brick.base, step_of(brick.level) * kCells);
        const std::int32_t half = step_of(brick.level) * kCells / 2;
        Brick fine =
            sample_between(brick, octant, closest_candidates(candidates.triangles, octant_base(brick, octant), half));
        entry = will_do(brick, octant, fine) ? store(brick) : divide(fine);
      } else {
        entry = store(brick);
      }
      block_.nodes[node + static_cast<std::size_t>(octant)] = entry;
    }
    return close_node(node);
  }

  // Triangles near the voxel brick that a field brick lies in.
  std::span<const std::uint32_t> listed(const Brick& brick) const {
    constexpr std::int32_t kSpan = static_cast<std::int32_t>(kBrickEdge) * kQuarters;
    const std::size_t at = grid_.brick_at(static_cast<std::uint32_t>(brick.base[0] / kSpan),
                                          static_cast<std::uint32_t>(brick.base[1] / kSpan),
                                          static_cast<std::uint32_t>(brick.base[2] / kSpan));
    const std::uint32_t n = field_.set.index[at];
    if (n == kNoBrick) return {};
    return std::span(field_.near_triangles)
        .subspan(field_.near_start[n], field_.near_start[n + 1] - field_.near_start[n]);
  }

  std::uint32_t store(Brick& brick) {
    if (brick.entry != kFarOutside) return brick.entry;
    const auto number = static_cast<std::uint32_t>(block_.levels.size());
    brick.entry = number | static_cast<std::uint32_t>(brick.level - kFinestLevel) << kLevelShift;
    block_.levels.push_back(static_cast<std::int8_t>(brick.level));
    block_.penetration.insert(block_.penetration.end(), brick.value.begin(), brick.value.end());
    block_.penetration.resize(block_.levels.size() * kFieldStride, 0);
    if (with_gradient_) store_gradient(brick);
    return brick.entry;
  }

  void store_gradient(const Brick& brick) {
    const std::int32_t step = step_of(brick.level);
    for (int at = 0; at < kSamples; ++at) {
      const auto n = static_cast<std::size_t>(at);
      const Vector p = place({brick.base[0] + at % kEdge * step, brick.base[1] + at / kEdge % kEdge * step,
                              brick.base[2] + at / (kEdge * kEdge) * step});
      const Vector g =
          grid_.voxel_size * exact_gradient(surface_, p, brick.closest[n], brick.value[n] > 0, grid_.voxel_size);
      for (int axis = 0; axis < 3; ++axis) block_.gradient.push_back(static_cast<float>(g[axis]));
    }
    block_.gradient.resize(block_.levels.size() * kFieldStride * 3, 0);
  }

  std::size_t open_node() {
    block_.nodes.resize(block_.nodes.size() + 8, kFarOutside);
    return block_.nodes.size() - 8;
  }
  // Eight times the same needs no node. Then none was opened below it either.
  std::uint32_t close_node(std::size_t node) {
    const std::uint32_t first = block_.nodes[node];
    const auto begin = block_.nodes.begin() + static_cast<std::ptrdiff_t>(node);
    if (std::any_of(begin, begin + 8, [&](std::uint32_t entry) { return entry != first; })) {
      return kNodeFlag | static_cast<std::uint32_t>(node / 8);
    }
    block_.nodes.resize(node);
    return first;
  }

  const Surface& surface_;
  const Grid& grid_;
  const InsideRuns& runs_;
  const BandField& field_;
  const InsideTest& inside_;
  const FieldTolerance& tolerance_;
  const bool with_gradient_;
  const double reach_;  // distances between voxel centres are known up to here. [m]
  Block block_;
};

std::uint32_t renumbered(std::uint32_t entry, std::uint32_t first_node, std::uint32_t first_brick) {
  if (entry >= kFarInside) return entry;
  return entry + ((entry & kNodeFlag) != 0 ? first_node : first_brick);
}

}  // namespace

FieldTree sample_field(const Surface& surface, const Grid& grid, const InsideRuns& runs, const BandField& field,
                       const InsideTest& inside, const FieldTolerance& tolerance, bool with_gradient) {
  FieldTree tree;
  for (std::size_t axis = 0; axis < 3; ++axis) tree.root_dims[axis] = (grid.dims[axis] + kRootCells - 1) / kRootCells;
  const std::size_t plane = std::size_t{tree.root_dims[0]} * tree.root_dims[1];
  std::vector<Block> blocks(plane * tree.root_dims[2]);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t n) {
    BlockSampler sampler(surface, grid, runs, field, inside, tolerance, with_gradient);
    blocks[n] = sampler.sample(static_cast<std::uint32_t>(n % tree.root_dims[0]),
                               static_cast<std::uint32_t>(n / tree.root_dims[0] % tree.root_dims[1]),
                               static_cast<std::uint32_t>(n / plane));
  });
  std::size_t bricks = 0;
  for (const Block& block : blocks) bricks += block.levels.size();
  tree.penetration.reserve(bricks * kFieldStride);
  if (with_gradient) tree.gradient.reserve(bricks * kFieldStride * 3);
  for (Block& block : blocks) {
    const auto first_node = static_cast<std::uint32_t>(tree.nodes.size() / 8);
    const auto first_brick = static_cast<std::uint32_t>(tree.levels.size());
    tree.roots.push_back(renumbered(block.root, first_node, first_brick));
    for (const std::uint32_t entry : block.nodes) tree.nodes.push_back(renumbered(entry, first_node, first_brick));
    tree.levels.insert(tree.levels.end(), block.levels.begin(), block.levels.end());
    tree.penetration.insert(tree.penetration.end(), block.penetration.begin(), block.penetration.end());
    tree.gradient.insert(tree.gradient.end(), block.gradient.begin(), block.gradient.end());
    if (block.worst_error > tree.worst_error) {
      tree.worst_error = block.worst_error;
      tree.worst_at = block.worst_at;
    }
    block = {};
  }
  return tree;
}

FieldCell find_cell(const Grid& grid, const FieldTree& tree, const Vector& p) {
  FieldCell cell;
  const Vector at = (p - grid.centre(0, 0, 0)) / grid.voxel_size;
  std::uint32_t index[3];
  for (int axis = 0; axis < 3; ++axis) {
    if (!(at[axis] >= 0 && at[axis] < grid.dims[static_cast<std::size_t>(axis)] - 1)) return cell;
    index[axis] = static_cast<std::uint32_t>(at[axis]);
  }
  std::uint32_t entry =
      tree.roots[(std::size_t{index[2] / kRootCells} * tree.root_dims[1] + index[1] / kRootCells) * tree.root_dims[0] +
                 index[0] / kRootCells];
  for (std::uint32_t edge = kRootCells / 2; entry < kFarInside && (entry & kNodeFlag) != 0; edge /= 2) {
    const std::uint32_t octant = (index[2] / edge % 2) * 4 + (index[1] / edge % 2) * 2 + index[0] / edge % 2;
    entry = tree.nodes[8 * std::size_t{entry & ~kNodeFlag} + octant];
  }
  if (entry >= kFarInside) return cell;
  cell.brick = entry & kNumberMask;
  const double scale = std::ldexp(1.0, -(static_cast<int>(entry >> kLevelShift) + kFinestLevel));
  double part[3];
  std::uint32_t low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = at[axis] * scale;
    low[axis] = static_cast<std::uint32_t>(cells) % static_cast<std::uint32_t>(kCells);
    part[axis] = cells - std::floor(cells);
  }
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    cell.samples[corner] = ((low[2] + d[2]) * kFieldEdge + low[1] + d[1]) * kFieldEdge + low[0] + d[0];
    cell.weights[corner] = 1;
    for (int axis = 0; axis < 3; ++axis) cell.weights[corner] *= d[axis] != 0 ? part[axis] : 1 - part[axis];
  }
  return cell;
}

}  // namespace vps

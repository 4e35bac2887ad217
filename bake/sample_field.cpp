// SPDX-License-Identifier: GPL-3.0-or-later
// From the coarsest bricks down: a finer brick is kept where its samples differ from the coarser one's interpolation.
#include "bake/sample_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/nearest_triangle.h"
#include "bake/octant_samples.h"

namespace vps {
namespace {

constexpr int kEdge = kFieldEdge;
constexpr int kSamples = kEdge * kEdge * kEdge;
constexpr int kCells = kEdge - 1;
const double kHalfDiagonal = std::sqrt(0.75);

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
  std::array<double, kSamples> value;   // exact
  std::array<double, kSamples> fitted;  // what is stored
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
        octant_(grid, runs, field),
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
    if (near) octant_.load({at[0], at[1], at[2]});
    if (!near || !any_in_band()) return side_of(at) ? kFarInside : kFarOutside;
    octant_.estimate();
    octant_base_ = base;
    Brick brick = sample_voxels(kCoarsestLevel, base);
    return divide(brick);
  }

  bool side_of(const std::uint32_t (&at)[3]) const {
    const std::uint32_t i[3] = {at[0] * kBrickEdge, at[1] * kBrickEdge, at[2] * kBrickEdge};
    if (i[0] >= grid_.dims[0] || i[1] >= grid_.dims[1] || i[2] >= grid_.dims[2]) return false;
    return field_.value(grid_, runs_, i[0], i[1], i[2]) > 0;
  }

  bool any_in_band() const {
    for (std::size_t n = 0; n < OctantSamples::number(0, 0, OctantSamples::kSide); ++n) {
      if (octant_.value(n) <= tolerance_.band_inner && octant_.value(n) >= -tolerance_.band_outer) return true;
    }
    return false;
  }

  // Where a brick of voxels' centres begins in the octant.
  std::array<int, 3> place_in_octant(const Brick& brick) const {
    std::array<int, 3> first;
    for (std::size_t axis = 0; axis < 3; ++axis) first[axis] = (brick.base[axis] - octant_base_[axis]) / kQuarters;
    return first;
  }

  Brick sample_voxels(int level, const Index& base) const {
    Brick brick{level, base, {}, {}, {}};
    const int step = level > 0 ? 2 : 1;
    const std::array<int, 3> first = place_in_octant(brick);
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const int i[3] = {first[0] + x * step, first[1] + y * step, first[2] + z * step};
          const std::size_t n = OctantSamples::number(i[0], i[1], i[2]);
          const double value = octant_.value(n);
          const double wanted = level > 0 ? octant_.shift_of_two(i[0], i[1], i[2]) : octant_.shift(i[0], i[1], i[2]);
          const double shifted = value + std::clamp(wanted * grid_.voxel_size, -tolerance_.error, tolerance_.error);
          const auto at = static_cast<std::size_t>(sample_at(x, y, z));
          brick.value[at] = value;
          brick.closest[at] = octant_.closest(n);
          // A sample stays on its side.
          brick.fitted[at] = shifted * value > 0 ? shifted : value;
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
    Brick brick{parent.level - 1, octant_base(parent, octant), {}, {}, {}};
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
    // Its samples at a neighbour's are not known, which shifts would need.
    brick.fitted = brick.value;
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

  // What interpolation in the cells between a brick's exact samples may err. [vx]
  struct BrickErrors {
    CellErrors cells;
    std::array<int, 3> first{};  // the brick's lowest cell
    double at(int x, int y, int z) const {
      constexpr auto kRow = static_cast<int>(kBrickEdge);
      return cells[static_cast<std::size_t>(((first[2] + z) * kRow + first[1] + y) * kRow + first[0] + x)];
    }
  };
  BrickErrors errors_between(const Brick& brick) const {
    if (brick.level == 0) return {octant_.errors(), place_in_octant(brick)};
    ChordLines lines;
    constexpr int kHalo = ChordLines::kHalo;
    std::fill_n(&lines.value[0][0][0], sizeof(lines.value) / sizeof(float), std::numeric_limits<float>::quiet_NaN());
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          const auto v =
              static_cast<float>(brick.value[static_cast<std::size_t>(sample_at(x, y, z))] / grid_.voxel_size);
          lines.value[0][kHalo + x][z * ChordLines::kSide + y] = v;
          lines.value[1][kHalo + y][z * ChordLines::kSide + x] = v;
          lines.value[2][kHalo + z][y * ChordLines::kSide + x] = v;
        }
      }
    }
    chord_errors(lines);
    BrickErrors errors;
    cell_errors(lines, errors.cells);
    return errors;
  }

  // Whether an octant may hold an error worth looking for.
  bool is_suspect(const Brick& brick, int octant, const BrickErrors& errors) const {
    const int low[3] = {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
    const double cell_edge = quarter() * step_of(brick.level);
    const double core = std::max(tolerance_.band_inner, tolerance_.band_outer) - kHalfDiagonal * grid_.voxel_size;
    for (int cell = 0; cell < 8; ++cell) {
      const int x = low[0] + (cell & 1);
      const int y = low[1] + (cell >> 1 & 1);
      const int z = low[2] + (cell >> 2);
      double nearest = std::numeric_limits<double>::infinity();
      double shift = 0;
      for (int corner = 0; corner < 8; ++corner) {
        const auto at = static_cast<std::size_t>(sample_at(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)));
        nearest = std::min(nearest, std::abs(brick.value[at]));
        shift = std::max(shift, std::abs(brick.fitted[at] - brick.value[at]));
      }
      double error = errors.at(x, y, z) * grid_.voxel_size;
      if (shift > 0) error = std::max(error / 2, shift);
      // Found by trying: fewer places tried miss errors, more find hardly any.
      constexpr double kWorthALook = 0.6;
      if (error > kWorthALook * tolerance_.error && nearest <= core + kHalfDiagonal * cell_edge) return true;
    }
    return false;
  }

  // Whether the coarser brick's interpolation will do at the finer one's samples, and as far as can be told between
  // them.
  bool will_do(const Brick& coarse, int octant, const Brick& fine) {
    const int low[3] = {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
    double worst = 0;
    std::size_t worst_at = 0;
    std::array<double, kSamples> spare;
    for (int z = 0; z < kEdge; ++z) {
      for (int y = 0; y < kEdge; ++y) {
        for (int x = 0; x < kEdge; ++x) {
          double sum = 0;
          for (int corner = 0; corner < 8; ++corner) {
            const int cx = low[0] + (x + (corner & 1)) / 2;
            const int cy = low[1] + (y + (corner >> 1 & 1)) / 2;
            const int cz = low[2] + (z + (corner >> 2)) / 2;
            sum += coarse.fitted[static_cast<std::size_t>(sample_at(cx, cy, cz))];
          }
          const auto at = static_cast<std::size_t>(sample_at(x, y, z));
          const double truth = fine.value[at];
          const double error = std::abs(sum / 8 - truth);
          const double limit = allowed(truth);
          spare[at] = limit - error;
          if (spare[at] < 0) return false;
          if (limit == tolerance_.error && error > worst) {
            worst = error;
            worst_at = at;
          }
        }
      }
    }
    if (fine.level == 0 && !has_room(spare, errors_between(fine))) return false;
    note_error(fine, worst_at, worst);
    return true;
  }

  void note_error(const Brick& brick, std::size_t sample, double error) {
    if (!(error > block_.worst_error)) return;
    block_.worst_error = error;
    const std::int32_t step = step_of(brick.level);
    const auto n = static_cast<int>(sample);
    block_.worst_at = place({brick.base[0] + n % kEdge * step, brick.base[1] + n / kEdge % kEdge * step,
                             brick.base[2] + n / (kEdge * kEdge) * step});
  }

  // Whether what samples' errors leave of the tolerance is enough for the cells between them.
  bool has_room(const std::array<double, kSamples>& spare, const BrickErrors& errors) const {
    // Nearly all estimates are too high: they add what the axes have at different places.
    constexpr double kShare = 0.04;
    for (int z = 0; z < kCells; ++z) {
      for (int y = 0; y < kCells; ++y) {
        for (int x = 0; x < kCells; ++x) {
          double least = std::numeric_limits<double>::infinity();
          for (int corner = 0; corner < 8; ++corner) {
            const int at = sample_at(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            least = std::min(least, spare[static_cast<std::size_t>(at)]);
          }
          if (kShare * grid_.voxel_size * errors.at(x, y, z) > least) return false;
        }
      }
    }
    return true;
  }

  // The entry of a brick: its own where it will do everywhere, else a node.
  std::uint32_t divide(Brick& brick) {
    if (brick.level == kFinestLevel) return store(brick);
    Candidates candidates;
    BrickErrors errors;
    if (brick.level <= 0) errors = errors_between(brick);
    const auto node = open_node();
    for (int octant = 0; octant < 8; ++octant) {
      std::uint32_t entry = kFarOutside;
      if (brick.level > 0) {
        Brick fine = sample_voxels(brick.level - 1, octant_base(brick, octant));
        entry = will_do(brick, octant, fine) ? store(brick) : divide(fine);
      } else if (is_suspect(brick, octant, errors)) {
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
    block_.penetration.insert(block_.penetration.end(), brick.fitted.begin(), brick.fitted.end());
    block_.penetration.resize(block_.levels.size() * kFieldStride, 0);
    for (std::size_t n = 0; n < kSamples; ++n) note_error(brick, n, std::abs(brick.fitted[n] - brick.value[n]));
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
  OctantSamples octant_;
  Index octant_base_{};  // of its sample (0,0,0)
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

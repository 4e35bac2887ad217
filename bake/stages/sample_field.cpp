// SPDX-License-Identifier: GPL-3.0-or-later
// Works from the coarsest bricks down. A finer brick is kept where the coarser one's interpolation is not good enough.
#include "bake/stages/sample_field.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "bake/stages/fine_samples.h"
#include "bake/stages/fit_samples.h"
#include "bake/stages/sample_brick.h"
#include "bake/stages/sample_errors.h"
#include "bake/vps_bake.h"

namespace vps::bake {
namespace {

constexpr int kSamples = FieldBrick::kSamples;
constexpr int kCells = FieldBrick::kCells;

// What has to be proven of interpolation, in allowed errors. A proof gives about twice the error that there is. With
// the default tolerance the finest cells keep this without one.
constexpr double kProven = 2.17;

constexpr int sample_at(int x, int y, int z) {
  return FieldBrick::sample_at(x, y, z);
}

// The part of the octree under one root, numbered from 0.
struct SampledBlock {
  std::uint32_t root = kFarOutside;
  std::vector<std::uint32_t> nodes;
  std::size_t bricks = 0;
  std::vector<double> penetration;
  std::vector<float> gradient;
  std::vector<std::int16_t> scaled;
  double worst_error = 0;
  Vector worst_at = Vector::Zero();
  double proven = 0;
};

// Of a brick's interpolation at the samples of the brick of half the size in an octant.
struct Verdict {
  bool good = true;
  bool hopeless = false;     // however samples are fitted
  double worst = 0;          // error within the band, if larger than all noted before [m]
  std::size_t worst_at = 0;  // of the finer brick's samples
};

struct Octant {
  NearList near;                   // triangles near it, where they were needed
  std::optional<FieldBrick> fine;  // of half the size, where its exact samples were needed
  Verdict verdict;
};
using Octants = std::array<Octant, 8>;

class BlockSampler {
 public:
  BlockSampler(const FieldSource& from, const SampleForm& form)
      : surface_(from.surface),
        grid_(from.grid),
        tolerance_(from.tolerance),
        allowed_(from.tolerance, from.grid.voxel_size),
        bricks_(from),
        form_(form) {}

  SampledBlock sample(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
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
  std::uint32_t sample_octant(const std::uint32_t (&at)[3]) {
    if (!bricks_.load(at)) return bricks_.is_inside(at) ? kFarInside : kFarOutside;
    FieldBrick brick;
    bricks_.load_octant(brick);
    return divide(brick, {});
  }

  // Whether an octant may hold an error that is large enough to test for.
  bool is_suspect(const FieldBrick& brick, int octant, const BrickErrors& errors) const {
    const int low[3] = {2 * (octant & 1), 2 * (octant >> 1 & 1), 2 * (octant >> 2)};
    const double cell_edge = bricks_.quarter() * FieldBrick::step_of(brick.level);
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
      // Found by experiment: testing fewer octants misses errors, testing more finds hardly any.
      constexpr double kWorthALook = 0.6;
      if (error > kWorthALook * tolerance_.error && nearest <= core + kHalfDiagonal * cell_edge) return true;
    }
    return false;
  }

  // The coarser brick's interpolation at the samples of the finer one.
  static BrickValues interpolate(const FieldBrick& coarse, int octant) {
    std::array<double, 27> corners;
    for (int n = 0; n < 27; ++n) {
      corners[static_cast<std::size_t>(n)] = coarse.fitted[static_cast<std::size_t>(coarse.in_octant(octant, n))];
    }
    BrickValues fine;
    fill_between<3>(
        corners, [](double a, double b) { return (a + b) / 2; }, fine);
    return fine;
  }

  // Whether the coarser brick's interpolation is good enough at the finer one's samples. For a finer brick of level 0
  // it also estimates the errors between them.
  Verdict judge(const FieldBrick& coarse, int octant, const FieldBrick& fine) const {
    Verdict verdict;
    const BrickValues interpolated = interpolate(coarse, octant);
    SampleErrors errors;
    compare_samples(interpolated, fine.value, allowed_, block_.worst_error, errors);
    verdict.good = errors.good;
    // Fitting halves an error at best.
    verdict.hopeless = errors.hopeless;
    for (std::size_t at = 0; at < kSamples && errors.good && errors.worse; ++at) {
      if (!(errors.limit[at] == tolerance_.error && errors.error[at] > verdict.worst)) continue;
      verdict.worst = errors.error[at];
      verdict.worst_at = at;
    }
    if (verdict.good && fine.level == 0) verdict.good = has_room(errors.spare, bricks_.errors(fine));
    return verdict;
  }

  // Whether `judge` would say so of the brick between voxel centres, without the exact samples of that brick.
  bool will_surely_do(const FieldBrick& coarse, int octant, std::span<const std::uint32_t> near) {
    for (int n = 0; n < 27; ++n) {
      const auto at = static_cast<std::size_t>(coarse.in_octant(octant, n));
      if (std::abs(coarse.fitted[at] - coarse.value[at]) > allowed_.at(coarse.value[at])) return false;
    }
    return bricks_.surely_interpolates(coarse, octant, near, block_.worst_error);
  }

  void note_error(const FieldBrick& brick, std::size_t sample, double error) {
    if (!(error > block_.worst_error)) return;
    block_.worst_error = error;
    block_.worst_at = bricks_.place(brick, sample);
  }

  double enough() const { return kProven * tolerance_.error; }

  // Whether the error is proven to be small enough everywhere in an octant, if that is asked for.
  bool is_proven(const FieldBrick& brick, int octant, const NearList& near) {
    if (!tolerance_.prove) return true;
    const double bound = bricks_.bound(brick, octant, near.all, enough());
    if (bound > enough()) return false;
    block_.proven = std::max(block_.proven, bound);
    return true;
  }

  // Whether the tolerance that remains at the samples covers the estimated errors of the cells between them.
  bool has_room(BrickValues& spare, const BrickErrors& errors) const {
    // Nearly all estimates are too high, because they add errors that the axes have at different places.
    constexpr double kShare = 0.04;
    // The least of a cell's corners, axis by axis.
    for (const int step : {sample_at(1, 0, 0), sample_at(0, 1, 0), sample_at(0, 0, 1)}) {
      for (std::size_t at = 0; at + static_cast<std::size_t>(step) < kSamples; ++at)
        spare[at] = std::min(spare[at], spare[at + static_cast<std::size_t>(step)]);
    }
    for (int z = 0; z < kCells; ++z) {
      for (int y = 0; y < kCells; ++y) {
        for (int x = 0; x < kCells; ++x) {
          const double least = spare[static_cast<std::size_t>(sample_at(x, y, z))];
          if (kShare * grid_.voxel_size * errors.at(x, y, z) > least) return false;
        }
      }
    }
    return true;
  }

  // The entry of a brick: its own if it is good enough everywhere, else a node's.
  // @param near  triangles near it, where some samples lie between the centres of voxels
  std::uint32_t divide(FieldBrick& brick, const NearList& near) {
    if (brick.level == kFinestLevel) return store_finest(brick, near);
    Octants octants;
    NearTriangles near_octants;
    if (brick.level > 0) {
      judge_at_voxels(brick, octants);
    } else {
      near_octants = judge_between(brick, near, octants);
    }
    fit(brick, octants);
    const auto node = open_node();
    for (int n = 0; n < 8; ++n) {
      const auto at = static_cast<std::size_t>(n);
      const std::uint32_t entry = store_or_divide(brick, n, octants[at]);
      block_.nodes[node + at] = entry;
    }
    return close_node(node);
  }

  void judge_at_voxels(const FieldBrick& brick, Octants& octants) {
    for (int n = 0; n < 8; ++n) {
      Octant& octant = octants[static_cast<std::size_t>(n)];
      if (tolerance_.prove) octant.near = bricks_.near_octant(n);
      bricks_.load_voxels(brick.level - 1, brick.octant_base(n), octant.fine.emplace());
      octant.verdict = judge(brick, n, *octant.fine);
    }
  }

  // @return the triangles that the octants refer to
  NearTriangles judge_between(const FieldBrick& brick, const NearList& near, Octants& octants) {
    NearTriangles near_octants;
    const BrickErrors errors = bricks_.errors(brick);
    for (int n = 0; n < 8; ++n) {
      Octant& octant = octants[static_cast<std::size_t>(n)];
      const bool suspect = is_suspect(brick, n, errors);
      if (!suspect && !tolerance_.prove) continue;
      if (near_octants.positions.empty()) {
        near_octants = bricks_.near_octants(brick, (brick.level == 0 ? bricks_.near(brick) : near).all);
      }
      octant.near = near_octants.in_octant(n);
      if (!suspect || will_surely_do(brick, n, octant.near.closest())) continue;
      bricks_.load_between(brick, n, octant.near.closest(), octant.fine.emplace());
      octant.verdict = judge(brick, n, *octant.fine);
    }
    return near_octants;
  }

  // Moves the brick's samples if more octants are good enough then, and those that were still are.
  void fit(FieldBrick& brick, Octants& octants) const {
    const auto may_gain = [](const Octant& octant) { return !octant.verdict.good && !octant.verdict.hopeless; };
    if (std::none_of(octants.begin(), octants.end(), may_gain)) return;
    const BrickValues before = brick.fitted;
    const double step = bricks_.quarter() * FieldBrick::step_of(brick.level);
    if (!fit_samples(known_samples(octants), brick.value, step, tolerance_.error, brick.fitted)) return;
    std::array<Verdict, 8> verdicts;
    bool gained = false;
    bool lost = false;
    for (int n = 0; n < 8; ++n) {
      const Octant& octant = octants[static_cast<std::size_t>(n)];
      Verdict& verdict = verdicts[static_cast<std::size_t>(n)];
      verdict = octant.fine ? judge(brick, n, *octant.fine) : octant.verdict;
      gained = gained || (verdict.good && !octant.verdict.good);
      lost = lost || (!verdict.good && octant.verdict.good);
    }
    if (lost || !gained) {
      brick.fitted = before;
      return;
    }
    for (std::size_t n = 0; n < octants.size(); ++n) octants[n].verdict = verdicts[n];
  }

  FineSamples known_samples(const Octants& octants) const {
    FineSamples samples;
    const auto add = [&](int n, const FieldBrick& fine, bool any_error) {
      for (int i = 0; i < kSamples; ++i) {
        const auto from = static_cast<std::size_t>(i);
        const std::size_t to = FineSamples::at(n, i);
        samples.value[to] = fine.value[from];
        samples.limit[to] = any_error ? FineSamples::kAnyError : allowed_.at(fine.value[from]);
      }
    };
    // Samples on faces between octants count as those of the octant that may be kept.
    for (const bool hopeless : {true, false}) {
      for (int n = 0; n < 8; ++n) {
        const Octant& octant = octants[static_cast<std::size_t>(n)];
        if (octant.fine && octant.verdict.hopeless == hopeless) add(n, *octant.fine, hopeless);
      }
    }
    return samples;
  }

  std::uint32_t store_or_divide(FieldBrick& brick, int n, Octant& octant) {
    if (octant.verdict.good && is_proven(brick, n, octant.near)) {
      if (octant.fine) note_error(*octant.fine, octant.verdict.worst_at, octant.verdict.worst);
      return store(brick);
    }
    if (!octant.fine) bricks_.load_between(brick, n, octant.near.closest(), octant.fine.emplace());
    return divide(*octant.fine, octant.near);
  }

  std::uint32_t store_finest(FieldBrick& brick, const NearList& near) {
    if (!tolerance_.prove) return store(brick);
    // Its samples are exact, and each point is the mean of corners that are no farther than this.
    double bound = kHalfDiagonal * bricks_.quarter() * FieldBrick::step_of(brick.level);
    if (bound > enough()) {
      const NearTriangles near_octants = bricks_.near_octants(brick, near.all);
      const auto proven = [&](double up_to) {
        double worst = 0;
        for (int octant = 0; octant < 8 && std::isfinite(worst); ++octant) {
          worst = std::max(worst, bricks_.bound(brick, octant, near_octants.in_octant(octant).all, up_to));
        }
        return worst;
      };
      const double found = proven(enough());
      bound = std::min(bound, std::isfinite(found) ? found : proven(bound));
    }
    block_.proven = std::max(block_.proven, bound);
    return store(brick);
  }

  std::uint32_t store(FieldBrick& brick) {
    if (brick.entry != kFarOutside) return brick.entry;
    brick.entry = octree::brick_entry(static_cast<std::uint32_t>(kFieldEdge * block_.bricks++), brick.level);
    for (std::size_t n = 0; n < kSamples; ++n) note_error(brick, n, std::abs(brick.fitted[n] - brick.value[n]));
    if (form_.lambda > 0) store_scaled(brick);
    if (form_.real) store_real(brick);
    return brick.entry;
  }

  void store_scaled(const FieldBrick& brick) {
    // Eq. (1) truncates; rounding to nearest halves the error at the same size.
    const double step = form_.step(brick.level);
    const double limit = form_.limit;
    for (const double v : brick.fitted)
      block_.scaled.push_back(static_cast<std::int16_t>(std::lrint(std::clamp(v / step, -limit, limit))));
  }

  void store_real(const FieldBrick& brick) {
    block_.penetration.insert(block_.penetration.end(), brick.fitted.begin(), brick.fitted.end());
    for (std::size_t n = 0; n < kSamples; ++n) {
      const Vector p = bricks_.place(brick, n);
      const Vector g =
          grid_.voxel_size * exact_gradient(surface_, p, brick.closest[n], brick.value[n] > 0, grid_.voxel_size);
      for (int axis = 0; axis < 3; ++axis) block_.gradient.push_back(static_cast<float>(g[axis]));
    }
  }

  std::size_t open_node() {
    block_.nodes.resize(block_.nodes.size() + 8, kFarOutside);
    return block_.nodes.size() - 8;
  }
  // Eight equal entries need no node. Then no node was opened below it either.
  std::uint32_t close_node(std::size_t node) {
    const std::uint32_t first = block_.nodes[node];
    const auto begin = block_.nodes.begin() + static_cast<std::ptrdiff_t>(node);
    if (std::any_of(begin, begin + 8, [&](std::uint32_t entry) { return entry != first; })) {
      return octree::node_entry(static_cast<std::uint32_t>(node / 8));
    }
    block_.nodes.resize(node);
    return first;
  }

  const Surface& surface_;
  const Grid& grid_;
  const FieldTolerance& tolerance_;
  const AllowedError allowed_;
  BrickSampler bricks_;
  const SampleForm& form_;
  SampledBlock block_;
};

std::uint32_t renumbered(std::uint32_t entry, std::uint32_t first_node, std::uint32_t first_slice) {
  if (octree::is_node(entry)) return entry + first_node;
  return octree::is_brick(entry) ? entry + first_slice : entry;
}

// Moves values of blocks to the end of the tree's.
template <class T>
void append(std::span<SampledBlock> blocks, std::vector<T> SampledBlock::*values, UnsetVector<T>& to) {
  std::vector<std::size_t> first;
  std::size_t end = to.size();
  for (const SampledBlock& block : blocks) {
    first.push_back(end);
    end += (block.*values).size();
  }
  to.resize(end);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t n) {
    const std::vector<T> from = std::exchange(blocks[n].*values, {});
    std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(first[n]));
  });
}

// All but the values.
void append(const SampledBlock& block, FieldTree& tree) {
  const auto first_node = static_cast<std::uint32_t>(tree.nodes.size() / 8);
  const auto first_slice = static_cast<std::uint32_t>(kFieldEdge * tree.bricks);
  tree.bricks += block.bricks;
  if (kFieldEdge * tree.bricks > kMostSlices) {
    throw BakeError("sample_field", fmt::format("the field needs more than the {} bricks of samples that an asset can "
                                                "hold; choose larger voxels, or a larger --field-error",
                                                kMostSlices / kFieldEdge));
  }
  tree.roots.push_back(renumbered(block.root, first_node, first_slice));
  for (const std::uint32_t entry : block.nodes) tree.nodes.push_back(renumbered(entry, first_node, first_slice));
  if (block.worst_error > tree.worst_error) {
    tree.worst_error = block.worst_error;
    tree.worst_at = block.worst_at;
  }
  tree.proven = std::max(tree.proven, block.proven);
}

// Planes belong to the nodes of roots. The others keep their order, so that nodes still refer to later ones only.
void put_nodes_of_roots_first(FieldTree& tree) {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(tree.nodes.size() / 8, kNone);
  std::uint32_t next = 0;
  for (const std::uint32_t root : tree.roots) {
    if (octree::is_node(root)) number[octree::node_of(root)] = next++;
  }
  for (std::uint32_t& n : number) {
    if (n == kNone) n = next++;
  }
  const auto renumber = [&](std::uint32_t& entry) {
    if (octree::is_node(entry)) entry = octree::node_entry(number[octree::node_of(entry)]);
  };
  for (std::uint32_t& root : tree.roots) renumber(root);
  const std::vector<std::uint32_t> before = std::move(tree.nodes);
  tree.nodes.resize(before.size());
  for (std::size_t n = 0; n < number.size(); ++n) {
    for (std::size_t octant = 0; octant < 8; ++octant) {
      std::uint32_t& entry = tree.nodes[8 * std::size_t{number[n]} + octant];
      entry = before[8 * n + octant];
      renumber(entry);
    }
  }
}

}  // namespace

FieldTree sample_field(const Surface& surface, const Grid& grid, const InsideRuns& runs, const BandField& field,
                       const InsideTest& inside, const FieldTolerance& tolerance, const SampleForm& form,
                       const StageProgress& progress) {
  FieldTree tree;
  for (std::size_t axis = 0; axis < 3; ++axis) tree.root_dims[axis] = (grid.dims[axis] + kRootCells - 1) / kRootCells;
  const std::size_t plane = std::size_t{tree.root_dims[0]} * tree.root_dims[1];
  const std::size_t count = plane * tree.root_dims[2];
  tree.roots.reserve(count);
  // Works in parts, so that not all samples are held twice.
  constexpr std::size_t kPart = 1 << 14;
  std::vector<SampledBlock> blocks(std::min(count, kPart));
  LoopProgress loop(progress, count);
  for (std::size_t first = 0; first < count; first += kPart) {
    const std::size_t end = std::min(first + kPart, count);
    tbb::parallel_for(first, end, [&](std::size_t n) {
      BlockSampler sampler({surface, grid, runs, field, inside, tolerance}, form);
      blocks[n - first] = sampler.sample(static_cast<std::uint32_t>(n % tree.root_dims[0]),
                                         static_cast<std::uint32_t>(n / tree.root_dims[0] % tree.root_dims[1]),
                                         static_cast<std::uint32_t>(n / plane));
      loop.step();
    });
    const std::span<SampledBlock> done(blocks.data(), end - first);
    append(done, &SampledBlock::penetration, tree.penetration);
    append(done, &SampledBlock::gradient, tree.gradient);
    append(done, &SampledBlock::scaled, tree.scaled);
    for (SampledBlock& block : done) append(std::exchange(block, {}), tree);
  }
  put_nodes_of_roots_first(tree);
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
  const std::uint32_t entry =
      octree::find_entry(tree.roots.data(), tree.nodes.data(), tree.root_dims.data(), index).entry;
  if (!octree::is_brick(entry)) return cell;
  cell.sampled = true;
  cell.level = octree::level_of(entry);
  const double scale = std::ldexp(1.0, -cell.level);
  double part[3];
  std::uint32_t low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const double cells = at[axis] * scale;
    low[axis] = static_cast<std::uint32_t>(cells) % static_cast<std::uint32_t>(kCells);
    part[axis] = cells - std::floor(cells);
  }
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    cell.samples[corner] = octree::sample_at(entry, low[0] + d[0], low[1] + d[1], low[2] + d[2]);
    cell.weights[corner] = 1;
    for (int axis = 0; axis < 3; ++axis) cell.weights[corner] *= d[axis] != 0 ? part[axis] : 1 - part[axis];
  }
  return cell;
}

}  // namespace vps::bake

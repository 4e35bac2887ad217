// SPDX-License-Identifier: GPL-3.0-or-later
// Hanging samples of an octree: the coarser side of a face knows only its corners, so the finer side must follow. Goes
// from the coarsest bricks down, because a brick that follows may be followed.
#include "bake/stages/close_faces.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bake/stages/octant_trial.h"

namespace vps::bake {
namespace {

constexpr auto kCells = static_cast<std::int32_t>(kFieldEdge - 1);
// Places are counted in the finest cells from the centre of voxel (0,0,0).
constexpr std::int32_t kPerVoxel = 1 << -kFinestLevel;

constexpr std::int32_t step_of(int level) {
  return 1 << (level - kFinestLevel);
}

struct Placed {
  std::uint32_t entry = kFarOutside;
  std::array<std::int32_t, 3> base{};  // first sample
};

class Faces {
 public:
  explicit Faces(const FieldTree& tree) : tree_(tree) {
    std::vector<std::uint8_t> seen(tree.levels.size(), 0);
    const std::size_t row = tree.root_dims[0];
    for (std::size_t n = 0; n < tree.roots.size(); ++n) {
      const std::size_t root[3] = {n % row, n / row % tree.root_dims[1], n / (row * tree.root_dims[1])};
      std::array<std::int32_t, 3> low;
      for (std::size_t axis = 0; axis < 3; ++axis) low[axis] = static_cast<std::int32_t>(root[axis]) * kRootEdge;
      list(tree.roots[n], low, kRootEdge, seen);
    }
  }

  // Calls close(brick, sample, coarser brick's entry, place in it) for each sample that another brick decides.
  template <class Close>
  void visit(int level, const Close& close) const {
    const std::vector<Placed>& bricks = by_level_[static_cast<std::size_t>(level - kFinestLevel)];
    tbb::parallel_for(std::size_t{0}, bricks.size(), [&](std::size_t n) { visit_brick(bricks[n], close); });
  }

 private:
  static constexpr auto kRootEdge = static_cast<std::int32_t>(kRootCells) * kPerVoxel;

  void list(std::uint32_t entry, const std::array<std::int32_t, 3>& low, std::int32_t edge,
            std::vector<std::uint8_t>& seen) {
    if (octree::is_node(entry)) {
      for (std::uint32_t octant = 0; octant < 8; ++octant) {
        std::array<std::int32_t, 3> corner = low;
        for (std::uint32_t axis = 0; axis < 3; ++axis) {
          if ((octant >> axis & 1) != 0) corner[axis] += edge / 2;
        }
        list(tree_.nodes[8 * std::size_t{octree::node_of(entry)} + octant], corner, edge / 2, seen);
      }
    } else if (octree::is_brick(entry) && seen[octree::brick_of(entry)] == 0) {
      seen[octree::brick_of(entry)] = 1;
      by_level_[static_cast<std::size_t>(octree::level_of(entry) - kFinestLevel)].push_back(placed(entry, low));
    }
  }

  // @param at  any place in the brick
  static Placed placed(std::uint32_t entry, const std::array<std::int32_t, 3>& at) {
    const std::int32_t edge = kCells * step_of(octree::level_of(entry));
    Placed brick{entry, {}};
    for (std::size_t axis = 0; axis < 3; ++axis) brick.base[axis] = at[axis] / edge * edge;
    return brick;
  }

  // The brick at a place, if its cells are larger than those of `level`.
  [[nodiscard]] std::optional<Placed> coarser_at(const std::array<std::int32_t, 3>& at, int level) const {
    std::uint32_t cell[3];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (at[axis] < 0 || at[axis] >= static_cast<std::int32_t>(tree_.root_dims[axis]) * kRootEdge) return {};
      cell[axis] = static_cast<std::uint32_t>(at[axis] / kPerVoxel);
    }
    const std::uint32_t entry =
        octree::find_entry(tree_.roots.data(), tree_.nodes.data(), tree_.root_dims.data(), cell).entry;
    if (!octree::is_brick(entry) || octree::level_of(entry) <= level) return {};
    return placed(entry, at);
  }

  // Entries of coarser bricks are aligned cubes that are no smaller than the brick: each of the 26 cubes of its size
  // around it lies in one whole, or touches none.
  template <class Close>
  void visit_brick(const Placed& brick, const Close& close) const {
    const int level = octree::level_of(brick.entry);
    const std::int32_t step = step_of(level);
    std::array<std::optional<Placed>, 27> around;
    bool any = false;
    for (int n = 0; n < 27; ++n) {
      const std::int32_t way[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      if (way[0] == 0 && way[1] == 0 && way[2] == 0) continue;
      std::array<std::int32_t, 3> at;
      for (std::size_t axis = 0; axis < 3; ++axis) at[axis] = brick.base[axis] + way[axis] * kCells * step;
      around[static_cast<std::size_t>(n)] = coarser_at(at, level);
      any = any || around[static_cast<std::size_t>(n)];
    }
    if (!any) return;
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(kFieldEdge * kFieldEdge * kFieldEdge); ++n) {
      constexpr auto kEdge = static_cast<std::int32_t>(kFieldEdge);
      const std::int32_t of_brick[3] = {n % kEdge, n / kEdge % kEdge, n / (kEdge * kEdge)};
      const Placed* coarsest = nullptr;
      for (std::size_t cube = 0; cube < around.size(); ++cube) {
        if (!around[cube] || !touches(of_brick, static_cast<int>(cube))) continue;
        if (coarsest == nullptr || octree::level_of(around[cube]->entry) > octree::level_of(coarsest->entry)) {
          coarsest = &*around[cube];
        }
      }
      if (coarsest == nullptr) continue;
      std::array<std::int32_t, 3> in_coarsest;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        in_coarsest[axis] = brick.base[axis] + of_brick[axis] * step - coarsest->base[axis];
      }
      close(brick.entry, static_cast<std::size_t>(n), coarsest->entry, in_coarsest);
    }
  }

  // Whether a sample of a brick lies on the cube beside it.
  static bool touches(const std::int32_t (&sample)[3], int cube) {
    const int way[3] = {cube % 3 - 1, cube / 3 % 3 - 1, cube / 9 - 1};
    for (int axis = 0; axis < 3; ++axis) {
      if (way[axis] != 0 && sample[axis] != (way[axis] < 0 ? 0 : kCells)) return false;
    }
    return true;
  }

  const FieldTree& tree_;
  std::array<std::vector<Placed>, kCoarsestLevel - kFinestLevel + 1> by_level_;
};

// What a brick's samples interpolate at a place, in the finest cells from its first sample.
template <class Sample>
double interpolate(std::span<const Sample> samples, std::uint32_t entry, const std::array<std::int32_t, 3>& at) {
  const std::int32_t step = step_of(octree::level_of(entry));
  std::uint32_t low[3];
  double part[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int32_t cell = std::min(at[axis] / step, kCells - 1);
    low[axis] = static_cast<std::uint32_t>(cell);
    part[axis] = static_cast<double>(at[axis] - cell * step) / step;
  }
  double sum = 0;
  for (std::uint32_t corner = 0; corner < 8; ++corner) {
    const std::uint32_t d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) weight *= d[axis] != 0 ? part[axis] : 1 - part[axis];
    if (weight == 0) continue;
    sum += weight *
           samples[octree::first_sample(entry) + octree::sample_in_brick(low[0] + d[0], low[1] + d[1], low[2] + d[2])];
  }
  return sum;
}

// @param step_of_brick  step_of_brick(number of a brick): of its samples. [m]
// @param round          from steps to a sample
template <class Sample, class Step, class Round>
void close(const FieldTree& tree, const FieldTolerance& tolerance, double voxel_size, std::span<Sample> samples,
           Step step_of_brick, Round round) {
  const double half_diagonal = kHalfDiagonal * voxel_size;
  const Faces faces(tree);
  for (int level = kCoarsestLevel - 1; level >= kFinestLevel; --level) {
    faces.visit(level, [&](std::uint32_t entry, std::size_t n, std::uint32_t coarser, const auto& at) {
      const double step = step_of_brick(octree::brick_of(entry));
      Sample& sample = samples[octree::first_sample(entry) + n];
      const double v = static_cast<double>(sample) * step;
      const double end = v > 0 ? tolerance.band_inner : tolerance.band_outer;
      // Samples beyond the band may be clamped at its end. The factor is for rounding.
      if (std::abs(v) >= (1 - 1e-9) * end) return;
      const double wanted =
          interpolate(std::span<const Sample>(samples), coarser, at) * step_of_brick(octree::brick_of(coarser));
      // Coarser cells that reach beyond the band may err by more than the certificate's bound.
      if (std::abs(v) > end - half_diagonal && std::abs(wanted - v) > tolerance.error) return;
      sample = round(wanted / step);
    });
  }
}

}  // namespace

void close_faces(const FieldTree& tree, const FieldTolerance& tolerance, double voxel_size, std::span<double> samples) {
  close(
      tree, tolerance, voxel_size, samples, [](std::uint32_t) { return 1.0; }, [](double v) { return v; });
}

void close_faces(const FieldTree& tree, const FieldTolerance& tolerance, double voxel_size, RoundedSamples rounded) {
  const double limit = rounded.limit;
  close(
      tree, tolerance, voxel_size, rounded.samples, [&](std::uint32_t brick) { return rounded.steps[brick]; },
      [limit](double v) { return static_cast<std::int16_t>(std::lrint(std::clamp(v, -limit, limit))); });
}

}  // namespace vps::bake

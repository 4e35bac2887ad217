// SPDX-License-Identifier: GPL-3.0-or-later
// Discregrid's cubic cells (Koschier et al., "Hierarchical hp-Adaptive Signed Distance Fields", 2016): serendipity
// nodes at the eight corners and at the thirds of the twelve edges.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <queue>
#include <unordered_map>
#include <vector>

#include "bake/quantity_text.h"
#include "cli/tools/export/export.h"
#include "cli/tools/stored_field.h"

namespace vps::cli {
namespace {

static_assert(std::endian::native == std::endian::little);

using CellIndex = std::array<std::int64_t, 3>;
constexpr std::uint32_t kNoCell = 0xFFFFFFFFu;
constexpr double kMostCorners = 67108864;  // 64 Mi: 800 MB of memory
constexpr double kMostBytes = 2147483647;  // Bullet counts them in an int

// The node of an edge: number 1 or 2 of its thirds, or 0 for the corner at its lower end.
struct Node {
  CellIndex corner;
  std::size_t axis;
  int third;
};

// The nodes of a cell, in the order of Bullet's shape functions.
std::array<Node, 32> cell_nodes(const CellIndex& cell) {
  std::array<Node, 32> nodes;
  std::size_t n = 0;
  for (std::int64_t c = 0; c < 8; ++c)
    nodes[n++] = {{cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2)}, 0, 0};
  for (std::size_t along = 0; along < 3; ++along) {
    const std::size_t fast = (along + 2) % 3, slow = (along + 1) % 3;
    for (std::int64_t e = 0; e < 4; ++e) {
      CellIndex corner = cell;
      corner[fast] += e & 1;
      corner[slow] += e >> 1;
      for (const int third : {1, 2}) nodes[n++] = {corner, along, third};
    }
  }
  return nodes;
}

class Cells {
 public:
  Cells(const VoxelmapView& map, const CdfOptions& options) : map_(map), step_(options.step), reach_(options.reach) {
    double corners = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = double(map.bounds_min[axis]), high = double(map.bounds_max[axis]);
      const double margin = reach_ + step_;
      const double cells = std::ceil((high - low + 2 * margin) / step_);
      origin_[axis] = (low + high) / 2 - step_ * cells / 2;
      corners *= cells + 1;
      // More do not fit an integer, and are refused below.
      cells_[axis] = static_cast<std::int64_t>(std::min(cells, kMostCorners));
    }
    if (!(corners <= kMostCorners)) {
      throw ExportError(fmt::format("{:.3g} cells are too many for this format; choose --step {} or larger voxels",
                                    corners, bake::format_length(step_ * std::cbrt(corners / kMostCorners))));
    }
  }

  std::string run() {
    measure_corners();
    fill(1);
    fill(-1);
    collect_cells();
    return write();
  }

 private:
  [[nodiscard]] std::size_t number(const CellIndex& corner) const {
    return static_cast<std::size_t>((corner[2] * (cells_[1] + 1) + corner[1]) * (cells_[0] + 1) + corner[0]);
  }
  [[nodiscard]] CellIndex corner_of(std::size_t number) const {
    const auto n = static_cast<std::int64_t>(number);
    return {n % (cells_[0] + 1), n / (cells_[0] + 1) % (cells_[1] + 1), n / ((cells_[0] + 1) * (cells_[1] + 1))};
  }
  [[nodiscard]] Vec3 place(const CellIndex& corner, std::size_t axis, int third) const {
    double p[3];
    for (std::size_t k = 0; k < 3; ++k) p[k] = origin_[k] + step_ * (double(corner[k]) + (k == axis ? third / 3.0 : 0));
    return {float(p[0]), float(p[1]), float(p[2])};
  }

  // V where it is exact, otherwise infinite with the sign of V: near the band's ends samples may be clamped.
  [[nodiscard]] float exact_depth(const CellIndex& corner, std::size_t axis, int third) const {
    const float v = stored_penetration(map_, place(corner, axis, third));
    const float margin = 0.867F * map_.voxel_size;
    return v <= map_.band_inner - margin && v >= margin - map_.band_outer
               ? v
               : std::copysign(std::numeric_limits<float>::infinity(), v);
  }

  void measure_corners() {
    depth_.resize(number({0, 0, cells_[2] + 1}));
    for (std::size_t n = 0; n < depth_.size(); ++n) depth_[n] = exact_depth(corner_of(n), 0, 0);
  }

  // Fills in V beyond the band on one side (1: inside, -1: outside). |V| of a corner is |V| of a corner in the band
  // plus the straight distance to it, for the corner that gives the least. The error is small, and the slope is that of
  // a distance.
  void fill(int sign) {
    using Entry = std::pair<float, std::uint32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
    std::unordered_map<std::uint32_t, std::uint32_t> seed;
    const auto side = static_cast<float>(sign);
    const auto is_far = [&](std::size_t n) { return std::isinf(depth_[n]) && (depth_[n] > 0) == (sign > 0); };
    std::vector<float> best = depth_;
    const auto spread = [&](std::uint32_t from, std::uint32_t source) {
      const CellIndex at = corner_of(from), root = corner_of(source);
      for (int k = 0; k < 27; ++k) {
        const CellIndex next = {at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1};
        bool in_grid = true;
        for (std::size_t axis = 0; axis < 3; ++axis) in_grid = in_grid && next[axis] >= 0 && next[axis] <= cells_[axis];
        if (!in_grid || !is_far(number(next))) continue;
        const auto to = static_cast<std::uint32_t>(number(next));
        const double way = std::hypot(double(next[0] - root[0]), double(next[1] - root[1]), double(next[2] - root[2]));
        const float depth = std::abs(depth_[source]) + float(step_ * way);
        if (depth >= std::abs(best[to])) continue;
        best[to] = side * depth;
        seed[to] = source;
        open.emplace(depth, to);
      }
    };
    for (std::uint32_t n = 0; n < depth_.size(); ++n) {
      if (!std::isinf(depth_[n]) && (depth_[n] >= 0) == (sign > 0)) spread(n, n);
    }
    while (!open.empty()) {
      const auto [depth, n] = open.top();
      open.pop();
      if (depth == std::abs(best[n])) spread(n, seed[n]);
    }
    depth_ = std::move(best);
  }

  void collect_cells() {
    map_of_cells_.assign(static_cast<std::size_t>(cells_[0] * cells_[1] * cells_[2]), kNoCell);
    std::size_t at = 0;
    for (std::int64_t z = 0; z < cells_[2]; ++z) {
      for (std::int64_t y = 0; y < cells_[1]; ++y) {
        for (std::int64_t x = 0; x < cells_[0]; ++x, ++at) add_cell({x, y, z}, at);
      }
    }
  }

  void add_cell(const CellIndex& cell, std::size_t at) {
    const std::array<Node, 32> nodes = cell_nodes(cell);
    std::array<float, 32> depths;
    bool wanted = false;
    for (std::size_t corner = 0; corner < 8; ++corner) wanted = wanted || depth_of(nodes[corner]) >= -float(reach_);
    if (!wanted) return;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      depths[n] = depth_of(nodes[n]);
      if (std::isinf(depths[n])) return;  // the field has no surface
    }
    std::array<std::uint32_t, 32> numbers;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const std::uint64_t key = (number(nodes[n].corner) * 3 + nodes[n].axis) * 3 + std::uint64_t(nodes[n].third);
      const auto [found, fresh] = node_numbers_.try_emplace(key, static_cast<std::uint32_t>(distances_.size()));
      if (fresh) distances_.push_back(-double(depths[n]));
      numbers[n] = found->second;
    }
    map_of_cells_[at] = static_cast<std::uint32_t>(cells_kept_.size());
    cells_kept_.push_back(numbers);
  }

  // V of a node, interpolated between corners where it is not exact. Infinite where there is none.
  [[nodiscard]] float depth_of(const Node& node) const {
    const float low = depth_[number(node.corner)];
    if (node.third == 0 || std::isinf(low)) return low;
    const float exact = exact_depth(node.corner, node.axis, node.third);
    if (!std::isinf(exact)) return exact;
    CellIndex other = node.corner;
    ++other[node.axis];
    const float high = depth_[number(other)];
    return low + float(node.third) / 3 * (high - low);
  }

  [[nodiscard]] std::string write() const {
    const double bytes =
        8.0 * double(distances_.size()) + 128.0 * double(cells_kept_.size()) + 4.0 * double(map_of_cells_.size());
    if (bytes > kMostBytes - 1000) {
      throw ExportError(fmt::format("{} are more than Bullet can read; choose a larger --step or larger voxels",
                                    bake::format_bytes(bytes)));
    }
    std::string out;
    out.reserve(static_cast<std::size_t>(bytes) + 1000);
    const auto put = [&](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
    const auto put_all = [&](const auto& values) {
      put(std::uint64_t{1});  // one field
      put(std::uint64_t{values.size()});
      for (const auto& value : values) put(value);
    };
    for (const double x : origin_) put(x);
    for (std::size_t axis = 0; axis < 3; ++axis) put(origin_[axis] + step_ * double(cells_[axis]));
    for (const std::int64_t n : cells_) put(static_cast<std::uint32_t>(n));
    for (int axis = 0; axis < 3; ++axis) put(step_);
    for (int axis = 0; axis < 3; ++axis) put(1 / step_);
    put(std::uint64_t{map_of_cells_.size()});
    put(std::uint64_t{1});
    put_all(distances_);
    put_all(cells_kept_);
    put_all(map_of_cells_);
    return out;
  }

  const VoxelmapView& map_;
  double step_;   // [m]
  double reach_;  // [m]
  CellIndex cells_{};
  std::array<double, 3> origin_{};
  std::vector<float> depth_;  // V of every corner; infinite beyond the band until it is filled. [m]
  std::vector<double> distances_;
  std::vector<std::array<std::uint32_t, 32>> cells_kept_;
  std::vector<std::uint32_t> map_of_cells_;
  std::unordered_map<std::uint64_t, std::uint32_t> node_numbers_;
};

}  // namespace

std::string to_cdf(const VoxelmapView& map, const CdfOptions& options) {
  if (map.field == Field::layers) throw ExportError("layers are too coarse for this; bake it with --fields scaled");
  return Cells(map, options).run();
}

}  // namespace vps::cli

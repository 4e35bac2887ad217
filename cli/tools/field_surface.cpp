// SPDX-License-Identifier: GPL-3.0-or-later
// Dual contouring (T. Ju et al., Dual Contouring of Hermite Data, 2002) where the field has an edge or a corner, and
// surface nets (S. Gibson, Constrained Elastic Surface Nets, 1998) where it is smooth. A cell has a vertex for each
// sheet, so that two sheets in one cell stay separate.
#include "cli/tools/field_surface.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <unordered_map>

namespace vps::cli {
namespace {

constexpr std::int64_t kBlock = 16;            // cells along a block's edge
constexpr double kMostSteps = 1024;            // along the longest side
constexpr double kMostCells = (1 << 21) - 2;   // along an axis: `key` has 21 bits for each
constexpr double kMostBlocks = 1 << 26;        // 5 seconds
constexpr std::size_t kMostNear = 1 << 17;     // blocks near the surface: a minute
constexpr std::size_t kMostCrossed = 1 << 23;  // cells with a part of the surface: 2 GB
constexpr double kCrease = 0.94;               // cosine between a normal and the mean one: less is an edge
constexpr double kFlat = 0.1;       // share of the largest eigenvalue: directions below it are along the edge
constexpr std::size_t kEdges = 12;  // of a cell, numbered 4 axis + index among the four along that axis

using Index = std::array<std::int64_t, 3>;
using Point = std::array<double, 3>;

// Number of the edge from `corner` along `axis`; `corner` is its lower end. Corner numbers are x + 2 y + 4 z.
constexpr std::size_t edge_from(std::size_t corner, std::size_t axis) {
  const std::size_t u = (axis + 1) % 3;
  const std::size_t v = (axis + 2) % 3;
  return 4 * axis + (corner >> u & 1) + 2 * (corner >> v & 1);
}

// The vertex of the cell that each of its edges belongs to.
struct CellSheets {
  std::uint32_t first_vertex = 0;
  std::array<std::uint8_t, kEdges> sheet{};
};

class DualSurface {
 public:
  DualSurface(const VoxelmapView& map, double step) : map_(map), step_(step) {
    double blocks = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // All is outside beyond the mesh's bounds, except with layers: voxels that touch the surface reach farther.
      const double margin = 1.5 * step + 2 * double(map.voxel_size);
      const double low = double(map.bounds_min[axis]) - margin;
      const double length = double(map.bounds_max[axis]) + margin - low;
      origin_[axis] = low;
      const double along = std::ceil(length / step / kBlock);
      if (!(along * kBlock <= kMostCells)) refuse_size();
      blocks_[axis] = static_cast<std::int64_t>(along);
      blocks *= along;
    }
    if (!(blocks <= kMostBlocks)) refuse_size();
  }

  FieldSurface run() {
    for (std::int64_t z = 0; z < blocks_[2]; ++z) {
      for (std::int64_t y = 0; y < blocks_[1]; ++y) {
        for (std::int64_t x = 0; x < blocks_[0]; ++x) visit_block({x * kBlock, y * kBlock, z * kBlock});
      }
    }
    for (const Crossing& crossing : crossings_) add_quad(crossing);
    measure();
    surface_.step = step_;
    return std::move(surface_);
  }

 private:
  // A grid edge that crosses the surface; four cells share it.
  struct Crossing {
    Index low;
    std::size_t axis;
    bool inside_first;
  };

  [[nodiscard]] Point place(const Index& i) const {
    return {origin_[0] + step_ * double(i[0]), origin_[1] + step_ * double(i[1]), origin_[2] + step_ * double(i[2])};
  }
  // Layers need a normal; with a zero normal V is that of the voxel's centre.
  [[nodiscard]] double value(const Point& p) const {
    return penetration(map_, {float(p[0]), float(p[1]), float(p[2])}, Vec3{});
  }
  static std::uint64_t key(const Index& i) {
    return std::uint64_t(i[2] + 1) << 42 | std::uint64_t(i[1] + 1) << 21 | std::uint64_t(i[0] + 1);
  }

  [[noreturn]] static void refuse_size() {
    throw FieldSurfaceError("its surface has too many cells of this size; choose a larger --step or larger voxels");
  }

  void visit_block(const Index& low) {
    // |V| exceeds the distance by at most the field's error.
    const Point middle = place({low[0] + kBlock / 2, low[1] + kBlock / 2, low[2] + kBlock / 2});
    const double reach = std::sqrt(3.0) / 2 * kBlock * step_ + double(map_.error) + 2 * double(map_.voxel_size);
    if (std::abs(value(middle)) > reach) return;
    if (++near_ > kMostNear) refuse_size();
    constexpr std::int64_t kSide = kBlock + 1;
    values_.resize(static_cast<std::size_t>(kSide * kSide * kSide));
    for (std::int64_t n = 0; n < kSide * kSide * kSide; ++n) {
      values_[static_cast<std::size_t>(n)] =
          value(place({low[0] + n % kSide, low[1] + n / kSide % kSide, low[2] + n / (kSide * kSide)}));
    }
    for (std::int64_t z = 0; z < kBlock; ++z) {
      for (std::int64_t y = 0; y < kBlock; ++y) {
        for (std::int64_t x = 0; x < kBlock; ++x) {
          std::array<double, 8> corners;
          for (std::size_t c = 0; c < 8; ++c) {
            const std::int64_t cx = x + std::int64_t(c & 1), cy = y + std::int64_t(c >> 1 & 1),
                               cz = z + std::int64_t(c >> 2);
            corners[c] = values_[static_cast<std::size_t>((cz * kSide + cy) * kSide + cx)];
          }
          visit_cell({low[0] + x, low[1] + y, low[2] + z}, corners);
        }
      }
    }
  }

  // Where a sheet crosses the edges of its cell, in parts of the cell's edge.
  struct Sheet {
    std::array<Point, kEdges> crossed;
    std::size_t count = 0;
    [[nodiscard]] Point mean() const {
      Point sum{};
      for (std::size_t i = 0; i < count; ++i) {
        for (std::size_t k = 0; k < 3; ++k) sum[k] += crossed[i][k];
      }
      for (double& part : sum) part /= double(count);
      return sum;
    }
  };

  void visit_cell(const Index& cell, const std::array<double, 8>& values) {
    unsigned inside = 0;
    for (std::size_t c = 0; c < 8; ++c) inside |= (values[c] >= 0 ? 1U : 0U) << c;
    if (inside == 0 || inside == 255) return;
    const std::array<std::uint8_t, kEdges> sheet = sheets(inside);
    const std::size_t count = 1 + *std::max_element(sheet.begin(), sheet.end());
    std::array<Sheet, 4> found;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t c = 0; c < 8; ++c) {
        const std::size_t other = c | std::size_t{1} << axis;
        if (other == c || ((inside >> c ^ inside >> other) & 1) == 0) continue;
        Sheet& of = found[sheet[edge_from(c, axis)]];
        const double part = values[c] / (values[c] - values[other]);
        for (std::size_t k = 0; k < 3; ++k) of.crossed[of.count][k] = k == axis ? part : double(c >> k & 1);
        ++of.count;
        if (c == 0) crossings_.push_back({cell, axis, (inside & 1) != 0});
      }
    }
    if (cells_.size() == kMostCrossed) refuse_size();
    cells_[key(cell)] = {static_cast<std::uint32_t>(surface_.mesh.vertices.size()), sheet};
    for (std::size_t s = 0; s < count; ++s) surface_.mesh.vertices.push_back(vertex_of(cell, found[s]));
  }

  // The sheet of each edge that the surface crosses. Two crossed edges of a face join into one sheet. Where all four
  // are crossed, the two inside corners of the face stay separate, in the same way for both cells of the face.
  static std::array<std::uint8_t, kEdges> sheets(unsigned inside) {
    std::array<std::uint8_t, kEdges> root;
    std::iota(root.begin(), root.end(), std::uint8_t{0});
    const auto join = [&](std::size_t a, std::size_t b) {
      const std::uint8_t from = root[a], to = root[b];
      for (std::uint8_t& r : root) r = r == from ? to : r;
    };
    const auto is_inside = [&](std::size_t corner) { return (inside >> corner & 1) != 0; };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = std::size_t{1} << (axis + 1) % 3, v = std::size_t{1} << (axis + 2) % 3;
      for (const std::size_t base : {std::size_t{0}, std::size_t{1} << axis}) {
        const std::array<std::size_t, 4> corner = {base, base | u, base | u | v, base | v};
        const std::array<std::size_t, 4> edge = {edge_from(base, (axis + 1) % 3), edge_from(base | u, (axis + 2) % 3),
                                                 edge_from(base | v, (axis + 1) % 3), edge_from(base, (axis + 2) % 3)};
        std::vector<std::size_t> crossed;  // edge i lies between corners i and i + 1
        for (std::size_t i = 0; i < 4; ++i) {
          if (is_inside(corner[i]) != is_inside(corner[(i + 1) % 4])) crossed.push_back(i);
        }
        if (crossed.size() == 2) join(edge[crossed[0]], edge[crossed[1]]);
        if (crossed.size() != 4) continue;
        for (std::size_t i = 0; i < 4; ++i) {
          if (is_inside(corner[i])) join(edge[i], edge[(i + 3) % 4]);
        }
      }
    }
    std::array<std::uint8_t, kEdges> sheet{};
    std::array<int, kEdges> number;
    number.fill(-1);
    int count = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t c = 0; c < 8; ++c) {
        const std::size_t other = c | std::size_t{1} << axis;
        if (other == c || is_inside(c) == is_inside(other)) continue;
        const std::size_t edge = edge_from(c, axis);
        if (number[root[edge]] < 0) number[root[edge]] = count++;
        sheet[edge] = static_cast<std::uint8_t>(number[root[edge]]);
      }
    }
    return sheet;
  }

  [[nodiscard]] Point vertex_of(const Index& cell, const Sheet& sheet) const {
    Point p{};
    return map_.field != Field::layers && find_feature(cell, sheet, p) ? p : settle(cell, sheet.mean());
  }

  // The point nearest to the tangent planes where the sheet crosses the cell's edges, if these planes make an edge or a
  // corner. Along an edge it is that nearest to the mean of the crossings.
  bool find_feature(const Index& cell, const Sheet& sheet, Point& feature) const {
    using Vector = Eigen::Vector3d;
    const Point low = place(cell);
    const Point mean = sheet.mean();
    const Vector middle(mean[0], mean[1], mean[2]);
    std::array<Vector, kEdges> normals;
    Vector sum = Vector::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    Vector offsets = Vector::Zero();
    for (std::size_t i = 0; i < sheet.count; ++i) {
      const Vector at(sheet.crossed[i][0], sheet.crossed[i][1], sheet.crossed[i][2]);
      const Vec3 p{float(low[0] + step_ * at.x()), float(low[1] + step_ * at.y()), float(low[2] + step_ * at.z())};
      const Vec3 out = outward_normal(map_, p);
      normals[i] = Vector(double(out.x), double(out.y), double(out.z));
      sum += normals[i];
      // The plane lies V outside the point.
      const double off = normals[i].dot(at - middle) + double(penetration(map_, p, Vec3{})) / step_;
      squares += normals[i] * normals[i].transpose();
      offsets += off * normals[i];
    }
    const double length = sum.norm();
    const bool smooth = std::all_of(normals.begin(), normals.begin() + std::ptrdiff_t(sheet.count),
                                    [&](const Vector& n) { return n.dot(sum) >= kCrease * length; });
    if (smooth) return false;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares);
    Vector best = middle;
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (axes.eigenvalues()[k] < kFlat * axes.eigenvalues()[2]) continue;
      const Vector axis = axes.eigenvectors().col(k);
      best += axis.dot(offsets) / axes.eigenvalues()[k] * axis;
    }
    for (std::size_t k = 0; k < 3; ++k) feature[k] = low[k] + step_ * std::clamp(best[Eigen::Index(k)], 0.0, 1.0);
    return true;
  }

  // Moves a point onto V = 0 along the field's normal, within the cell. @param part  place in the cell, 0 to 1
  [[nodiscard]] Point settle(const Index& cell, const Point& part) const {
    const Point low = place(cell);
    Point p = {low[0] + step_ * part[0], low[1] + step_ * part[1], low[2] + step_ * part[2]};
    if (map_.field == Field::layers) return p;
    for (int round = 0; round < 3; ++round) {
      const double v = value(p);
      const Vec3 out = outward_normal(map_, {float(p[0]), float(p[1]), float(p[2])});
      const double to[3] = {double(out.x), double(out.y), double(out.z)};
      Point moved = p;
      for (std::size_t k = 0; k < 3; ++k) moved[k] = std::clamp(p[k] + v * to[k], low[k], low[k] + step_);
      if (std::abs(value(moved)) >= std::abs(v)) break;
      p = moved;
    }
    return p;
  }

  void add_quad(const Crossing& crossing) {
    const std::size_t u = (crossing.axis + 1) % 3, v = (crossing.axis + 2) % 3;
    std::array<std::uint32_t, 4> corner;
    constexpr std::array<std::array<int, 2>, 4> kRound = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    for (std::size_t i = 0; i < 4; ++i) {
      Index cell = crossing.low;
      cell[u] -= kRound[i][0];
      cell[v] -= kRound[i][1];
      const auto found = cells_.find(key(cell));
      if (found == cells_.end()) {
        throw FieldSurfaceError("the field is not that of a solid: its surface has an end; bake the asset again");
      }
      const std::size_t lower = std::size_t(kRound[i][0]) << u | std::size_t(kRound[i][1]) << v;
      corner[i] = found->second.first_vertex + found->second.sheet[edge_from(lower, crossing.axis)];
    }
    if (!crossing.inside_first) std::swap(corner[1], corner[3]);
    const auto& at = surface_.mesh.vertices;
    // Along the diagonal that is nearer to the surface: the other one cuts off an edge, or bridges it.
    const auto off = [&](std::size_t a, std::size_t b) {
      Point middle;
      for (std::size_t k = 0; k < 3; ++k) middle[k] = (at[corner[a]][k] + at[corner[b]][k]) / 2;
      return std::abs(value(middle));
    };
    const std::size_t turn = off(0, 2) <= off(1, 3) ? 0 : 1;
    for (const std::array<std::size_t, 3>& t : {std::array<std::size_t, 3>{0, 1, 2}, {0, 2, 3}}) {
      surface_.mesh.triangles.push_back(
          {corner[(t[0] + turn) % 4], corner[(t[1] + turn) % 4], corner[(t[2] + turn) % 4]});
    }
  }

  void measure() {
    const auto& at = surface_.mesh.vertices;
    for (const Point& p : at) surface_.residual = std::max(surface_.residual, std::abs(value(p)));
    for (const auto& [a, b, c] : surface_.mesh.triangles) {
      Point middle;
      for (std::size_t k = 0; k < 3; ++k) middle[k] = (at[a][k] + at[b][k] + at[c][k]) / 3;
      surface_.residual = std::max(surface_.residual, std::abs(value(middle)));
    }
  }

  const VoxelmapView& map_;
  const double step_;
  Point origin_{};
  Index blocks_{};
  std::size_t near_ = 0;  // blocks near the surface
  std::vector<double> values_;
  std::vector<Crossing> crossings_;
  std::unordered_map<std::uint64_t, CellSheets> cells_;
  FieldSurface surface_;
};

}  // namespace

FieldSurface make_field_surface(const VoxelmapView& map, double step) {
  if (!(step >= 0.25 * double(map.voxel_size)))
    throw std::invalid_argument("the field has no samples so fine; choose a step of a quarter of a voxel or more");
  return DualSurface(map, step).run();
}

double step_for(const AssetInfo& info, double triangles, double finest) {
  // A surface crosses about 1.5 grid edges for each square of the grid, and each edge gives two triangles.
  double longest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    longest = std::max(longest, info.bounds_max[axis] - info.bounds_min[axis]);
  return std::max({finest * info.voxel_size, std::sqrt(3 * info.surface_area / triangles), longest / kMostSteps});
}

}  // namespace vps::cli

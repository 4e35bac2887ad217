// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/close_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>
#include <unordered_set>

#include "bake/grid.h"
#include "bake/repair/clean_mesh.h"
#include "bake/repair/topology.h"
#include "bake/repair/triangulate_hole.h"

namespace vps::bake {
namespace {

using Cell = Eigen::Array<std::int64_t, 3, 1>;

// Hash grid with cells of the tolerance's size.
class NearPoints {
 public:
  NearPoints(const std::vector<Vector>& points, double tolerance) : points_(points), cell_(tolerance) {}

  void add(std::uint32_t point) { cells_[key(cell_of(points_[point]))].push_back(point); }

  // Calls visit(point) for every added point in the cells that the box touches.
  template <class Visit>
  void near(const Vector& low, const Vector& high, Visit visit) const {
    const Cell first = cell_of(low);
    const Cell last = cell_of(high);
    for (std::int64_t z = first.z(); z <= last.z(); ++z) {
      for (std::int64_t y = first.y(); y <= last.y(); ++y) {
        for (std::int64_t x = first.x(); x <= last.x(); ++x) {
          const auto it = cells_.find(key({x, y, z}));
          if (it == cells_.end()) continue;
          for (const std::uint32_t p : it->second) visit(p);
        }
      }
    }
  }

 private:
  [[nodiscard]] Cell cell_of(const Vector& p) const { return (p.array() / cell_).floor().cast<std::int64_t>(); }
  // Two cells may share a key, because the caller checks distances anyway.
  static std::uint64_t key(const Cell& c) {
    return static_cast<std::uint64_t>(c.x()) * 0x9E3779B97F4A7C15u ^
           static_cast<std::uint64_t>(c.y()) * 0xC2B2AE3D27D4EB4Fu ^
           static_cast<std::uint64_t>(c.z()) * 0x165667B19E3779F9u;
  }

  const std::vector<Vector>& points_;
  double cell_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

// Merges each candidate with the nearest earlier one within the tolerance.
std::size_t merge(Mesh& mesh, const std::vector<std::uint32_t>& candidates, double tolerance) {
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::uint32_t v = 0; v < number.size(); ++v) number[v] = v;
  NearPoints kept(mesh.vertices, tolerance);
  std::size_t merged = 0;
  for (const std::uint32_t v : candidates) {
    const Vector& p = mesh.vertices[v];
    double nearest = tolerance * tolerance;
    kept.near(p - Vector::Constant(tolerance), p + Vector::Constant(tolerance), [&](std::uint32_t other) {
      const double squared = (mesh.vertices[other] - p).squaredNorm();
      if (squared > nearest || (squared == nearest && number[v] != v && other > number[v])) return;
      nearest = squared;
      number[v] = other;
    });
    if (number[v] == v) {
      kept.add(v);
    } else {
      ++merged;
    }
  }
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = number[v];
  }
  drop_collapsed(mesh);
  drop_unused_vertices(mesh);
  return merged;
}

struct OpenEdges {
  std::vector<EdgeUse> edges;           // one per missing use; `from` and `to` in the surface's direction
  std::vector<std::uint32_t> vertices;  // of these edges, in rising order
};

OpenEdges find_open_edges(const Mesh& mesh) {
  OpenEdges open;
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  for_each_edge(std::span(uses), [&](std::span<const EdgeUse> edge) {
    int balance = edge_balance(edge);
    for (const EdgeUse& use : edge) {
      if (balance == 0 || (use.forward != 0) != (balance > 0)) continue;
      open.edges.push_back(use);
      balance += balance > 0 ? -1 : 1;
    }
  });
  for (const EdgeUse& use : open.edges) {
    open.vertices.push_back(use.low());
    open.vertices.push_back(use.high());
  }
  std::sort(open.vertices.begin(), open.vertices.end());
  open.vertices.erase(std::unique(open.vertices.begin(), open.vertices.end()), open.vertices.end());
  return open;
}

// Splits triangles at border vertices that lie within the tolerance of their open edges.
std::size_t split_open_edges(Mesh& mesh, double tolerance) {
  const OpenEdges open = find_open_edges(mesh);
  if (open.edges.empty()) return 0;
  double mean = 0;
  for (const EdgeUse& use : open.edges) mean += (mesh.vertices[use.low()] - mesh.vertices[use.high()]).norm();
  NearPoints border(mesh.vertices, std::max(tolerance, mean / static_cast<double>(open.edges.size())));
  for (const std::uint32_t v : open.vertices) border.add(v);

  std::size_t splits = 0;
  std::unordered_set<std::uint32_t> touched;
  const std::size_t before = mesh.triangles.size();
  std::vector<std::uint8_t> replaced(before, 0);
  for (const EdgeUse& use : open.edges) {
    // A triangle with two open edges is split on one of them per pass.
    if (!touched.insert(use.triangle).second) continue;
    const std::uint32_t a = use.from();
    const std::uint32_t b = use.to();
    std::uint32_t c = a;
    for (const std::uint32_t v : mesh.triangles[use.triangle]) c = v != a && v != b ? v : c;
    const Vector& pa = mesh.vertices[a];
    const Vector along = mesh.vertices[b] - pa;
    const double squared = along.squaredNorm();
    std::vector<std::pair<double, std::uint32_t>> on_edge;
    const Vector margin = Vector::Constant(tolerance);
    border.near(pa.cwiseMin(mesh.vertices[b]) - margin, pa.cwiseMax(mesh.vertices[b]) + margin, [&](std::uint32_t v) {
      if (v == a || v == b || v == c) return;
      const double s = (mesh.vertices[v] - pa).dot(along) / squared;
      if (!(s > 0 && s < 1) || (pa + s * along - mesh.vertices[v]).norm() > tolerance) return;
      on_edge.emplace_back(s, v);
    });
    if (on_edge.empty()) continue;
    std::sort(on_edge.begin(), on_edge.end());
    on_edge.erase(std::unique(on_edge.begin(), on_edge.end()), on_edge.end());
    replaced[use.triangle] = 1;
    std::uint32_t previous = a;
    for (const auto& [s, v] : on_edge) {
      mesh.triangles.push_back({previous, v, c});
      previous = v;
      ++splits;
    }
    mesh.triangles.push_back({previous, b, c});
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t < before && replaced[t] != 0) continue;
    mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  drop_collapsed(mesh);
  return splits;
}

// Simple loops of missing edges, each directed so that triangles along it close the surface.
std::vector<std::vector<std::uint32_t>> find_loops(const Mesh& mesh) {
  const OpenEdges open = find_open_edges(mesh);
  std::map<std::uint32_t, std::vector<std::uint32_t>> next;  // against the surface's own direction
  for (auto it = open.edges.rbegin(); it != open.edges.rend(); ++it) next[it->to()].push_back(it->from());
  std::vector<std::vector<std::uint32_t>> loops;
  for (auto& [start, ends] : next) {
    while (!ends.empty()) {
      std::vector<std::uint32_t> path = {start};
      std::unordered_map<std::uint32_t, std::size_t> position = {{start, 0}};
      while (!path.empty()) {
        std::vector<std::uint32_t>& from = next[path.back()];
        if (from.empty()) break;  // cannot happen: a boundary has no boundary
        const std::uint32_t to = from.back();
        from.pop_back();
        const auto seen = position.find(to);
        if (seen == position.end()) {
          position[to] = path.size();
          path.push_back(to);
          continue;
        }
        // The path returned to one of its vertices. The part since then is a loop; the rest of the path continues.
        loops.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(seen->second), path.end());
        const std::size_t keep = seen->second;
        for (std::size_t i = keep + 1; i < path.size(); ++i) position.erase(path[i]);
        path.resize(keep + 1);
        if (keep == 0) break;
      }
    }
  }
  return loops;
}

double least_height(const Vector& a, const Vector& b, const Vector& c) {
  const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return longest > 0 ? (b - a).cross(c - a).norm() / longest : 0;
}

}  // namespace

std::size_t count_unbalanced(std::span<const EdgeUse> uses) {
  std::size_t count = 0;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) { count += edge_balance(edge) != 0; });
  return count;
}

std::size_t count_unbalanced(const Mesh& mesh) {
  return count_unbalanced(sorted_edges(mesh.triangles));
}

std::size_t weld_vertices(Mesh& mesh, double tolerance) {
  std::vector<std::uint32_t> all(mesh.vertices.size());
  for (std::uint32_t v = 0; v < all.size(); ++v) all[v] = v;
  return merge(mesh, all, tolerance);
}

std::size_t merge_borders(Mesh& mesh, double tolerance) {
  return merge(mesh, find_open_edges(mesh).vertices, tolerance);
}

std::size_t stitch_borders(Mesh& mesh, double tolerance) {
  std::size_t changes = merge_borders(mesh, tolerance);
  // Splitting one edge of a triangle leaves its others to the next pass.
  for (int pass = 0; pass < 8; ++pass) {
    const std::size_t splits = split_open_edges(mesh, tolerance);
    if (splits == 0) break;
    changes += splits;
  }
  return changes;
}

FilledHoles fill_holes(Mesh& mesh, double widest) {
  FilledHoles result;
  for (const std::vector<std::uint32_t>& loop : find_loops(mesh)) {
    if (loop.size() < 3) continue;
    std::vector<Vector> border;
    Vector middle = Vector::Zero();
    double length = 0;
    for (std::size_t i = 0; i < loop.size(); ++i) {
      border.push_back(mesh.vertices[loop[i]]);
      middle += border.back() / static_cast<double>(loop.size());
      length += (mesh.vertices[loop[(i + 1) % loop.size()]] - border.back()).norm();
    }
    std::vector<Triangle> patch = triangulate_hole(border);
    if (patch.empty()) {
      // A fan around the middle always exists.
      border.push_back(middle);
      const auto centre = static_cast<std::uint32_t>(loop.size());
      for (std::uint32_t i = 0; i < centre; ++i) patch.push_back({i, (i + 1) % centre, centre});
    }
    double width = 0;
    for (const auto& [a, b, c] : patch) width = std::max(width, least_height(border[a], border[b], border[c]));
    if (width > widest) {
      ++result.left;
      result.widest = std::max(result.widest, width);
      if (length > result.longest_border) {
        result.longest_border = length;
        result.place = border.front();
      }
      continue;
    }
    std::vector<std::uint32_t> numbers = loop;
    if (border.size() > loop.size()) {
      numbers.push_back(static_cast<std::uint32_t>(mesh.vertices.size()));
      mesh.vertices.push_back(middle);
    }
    for (const auto& [a, b, c] : patch) {
      mesh.triangles.push_back({numbers[a], numbers[b], numbers[c]});
      result.area += mesh.area_normal(mesh.triangles.size() - 1).norm() / 2;
    }
    ++result.filled;
  }
  return result;
}

std::size_t close_slivers(Mesh& mesh, double size, double voxel_size) {
  if (count_unbalanced(mesh) == 0) return 0;
  constexpr double kRounding = 1e-9;
  constexpr double kSliver_vx = 0.1;  // width of holes
  CleanCounts ignored;
  weld_vertices(mesh, kRounding * size);
  drop_duplicates(mesh, ignored);
  stitch_borders(mesh, kRounding * size);
  drop_duplicates(mesh, ignored);
  fill_holes(mesh, kSliver_vx * voxel_size);
  return count_unbalanced(mesh);
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/clean_mesh.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "bake/repair/topology.h"
#include "formats/mesh/position_numbers.h"

namespace vps::bake {
namespace {

// The three vertices in rising order, and whether the triangle's own order is an even permutation of that.
struct Corners {
  Triangle sorted;
  bool even;
};

Corners sorted_corners(const Triangle& t) {
  Triangle s = t;
  std::sort(s.begin(), s.end());
  return {s, (t[0] < t[1]) + (t[1] < t[2]) + (t[2] < t[0]) == 2};
}

// Whether one triangle of each group with as many facing one way as the other stays. A patch of them that the others
// leave open along its border is their surface. Where they are closed without it, it is a wall or a fin.
// @param triangles  the others, then one of each group
std::vector<std::uint8_t> stays(const std::vector<Triangle>& triangles, std::size_t groups) {
  const std::size_t others = triangles.size() - groups;
  const UnsetVector<EdgeUse> uses = sorted_edges(triangles);
  const auto count_others = [&](std::span<const EdgeUse> edge) {
    return std::count_if(edge.begin(), edge.end(), [&](const EdgeUse& use) { return use.triangle < others; });
  };
  const auto is_inside = [&](std::span<const EdgeUse> edge) { return edge.size() == 2 && count_others(edge) == 0; };
  DisjointSets patches(triangles.size());
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (is_inside(edge)) patches.join(edge[0].triangle, edge[1].triangle);
  });
  // Edges of a patch's border that it closes, minus those that are closed without it.
  std::vector<int> open(triangles.size(), 0);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (is_inside(edge)) return;
    const auto beside = count_others(edge);
    for (const EdgeUse& use : edge) open[patches.find(use.triangle)] += beside == 0 ? 0 : (beside % 2 == 1 ? 1 : -1);
  });
  std::vector<std::uint8_t> out(groups);
  for (std::size_t g = 0; g < groups; ++g)
    out[g] = open[patches.find(static_cast<std::uint32_t>(others + g))] >= 0 ? 1 : 0;
  return out;
}

}  // namespace

std::size_t drop_collapsed(Mesh& mesh) {
  return std::erase_if(mesh.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

Mesh join_vertices(const TriangleMesh& mesh, CleanCounts& counts) {
  Mesh joined;
  PositionNumbers<Vector> numbers(mesh.vertices.size());
  joined.triangles.reserve(mesh.triangles.size());
  std::vector<std::uint32_t> number(mesh.vertices.size(), kNoBrick);
  for (const auto& triangle : mesh.triangles) {
    Triangle t{};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& n = number[triangle[k]];
      if (n == kNoBrick) n = numbers.number_of(Vector(mesh.vertices[triangle[k]].data()));
      t[k] = n;
    }
    joined.triangles.push_back(t);
  }
  joined.vertices = std::move(numbers).take_positions();
  counts.collapsed += drop_collapsed(joined);
  drop_unused_vertices(joined);
  return joined;
}

void drop_duplicates(Mesh& mesh, CleanCounts& counts) {
  const std::size_t n = mesh.triangles.size();
  std::vector<Corners> corners(n);
  for (std::size_t t = 0; t < n; ++t) corners[t] = sorted_corners(mesh.triangles[t]);
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  tbb::parallel_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tie(corners[a].sorted, a) < std::tie(corners[b].sorted, b);
  });
  std::vector<std::uint8_t> keep(n, 1);
  std::vector<std::uint32_t> even;  // the first of each group with as many facing one way as the other
  for (std::size_t i = 0; i < n;) {
    std::size_t end = i + 1;
    while (end < n && corners[order[end]].sorted == corners[order[i]].sorted) ++end;
    if (end - i > 1) {
      int net = 0;
      for (std::size_t k = i; k < end; ++k) net += corners[order[k]].even ? 1 : -1;
      for (std::size_t k = i; k < end; ++k) keep[order[k]] = 0;
      if (net == 0) even.push_back(order[i]);
      for (std::size_t k = i; k < end && net != 0; ++k) {
        if (corners[order[k]].even != (net > 0)) continue;
        keep[order[k]] = 1;
        break;
      }
    }
    i = end;
  }
  if (!even.empty()) {
    std::vector<Triangle> triangles;
    for (std::size_t t = 0; t < n; ++t) {
      if (keep[t] != 0) triangles.push_back(mesh.triangles[t]);
    }
    for (const std::uint32_t t : even) triangles.push_back(mesh.triangles[t]);
    const std::vector<std::uint8_t> stay = stays(triangles, even.size());
    for (std::size_t g = 0; g < even.size(); ++g) keep[even[g]] = stay[g];
  }
  std::size_t kept = 0;
  for (std::size_t t = 0; t < n; ++t) {
    if (keep[t] != 0) mesh.triangles[kept++] = mesh.triangles[t];
  }
  counts.duplicates += n - kept;
  mesh.triangles.resize(kept);
  drop_unused_vertices(mesh);
}

}  // namespace vps::bake

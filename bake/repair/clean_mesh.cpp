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
  std::vector<std::pair<std::size_t, std::size_t>> even_groups;  // as many face one way as the other
  for (std::size_t i = 0; i < n;) {
    std::size_t end = i + 1;
    while (end < n && corners[order[end]].sorted == corners[order[i]].sorted) ++end;
    if (end - i > 1) {
      int net = 0;
      for (std::size_t k = i; k < end; ++k) net += corners[order[k]].even ? 1 : -1;
      for (std::size_t k = i; k < end; ++k) keep[order[k]] = 0;
      if (net == 0) even_groups.emplace_back(i, end);
      for (std::size_t k = i; k < end && net != 0; ++k) {
        if (corners[order[k]].even != (net > 0)) continue;
        keep[order[k]] = 1;
        break;
      }
    }
    i = end;
  }
  if (!even_groups.empty()) {
    const Pieces pieces = pieces_by_edges(mesh.triangles, sorted_edges(mesh.triangles));
    std::vector<std::uint8_t> something_left(pieces.count, 0);
    for (std::size_t t = 0; t < n; ++t) something_left[pieces.of_triangle[t]] |= keep[t];
    for (const auto& [first, last] : even_groups) {
      if (something_left[pieces.of_triangle[order[first]]] == 0) keep[order[first]] = 1;
    }
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

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/topology.h"

#include <tbb/parallel_for.h>

#include <atomic>
#include <numeric>
#include <tuple>

#include "bake/grid.h"

namespace vps::bake {
namespace {

Pieces number_pieces(DisjointSets& sets, std::size_t triangles) {
  Pieces pieces;
  pieces.of_triangle.resize(triangles);
  std::vector<std::uint32_t> number(triangles, kNoBrick);
  for (std::uint32_t t = 0; t < triangles; ++t) {
    std::uint32_t& n = number[sets.find(t)];
    if (n == kNoBrick) n = pieces.count++;
    pieces.of_triangle[t] = n;
  }
  return pieces;
}

}  // namespace

UnsetVector<EdgeUse> sorted_edges(const std::vector<Triangle>& triangles) {
  // Counted by the smaller vertex first: few edges remain to be compared. Threads take places in any order, but what
  // is compared after that differs between any two uses of an edge.
  const auto for_each_use = [&](auto visit) {
    tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
      for (std::size_t k = 0; k < 3; ++k)
        visit(static_cast<std::uint32_t>(t), triangles[t][k], triangles[t][(k + 1) % 3]);
    });
  };
  std::uint32_t vertices = 0;
  for (const Triangle& t : triangles) vertices = std::max({vertices, t[0] + 1, t[1] + 1, t[2] + 1});
  std::vector<std::uint32_t> start(vertices + 1, 0);
  const auto add_one = [](std::uint32_t& number) {
    return std::atomic_ref(number).fetch_add(1, std::memory_order_relaxed);
  };
  for_each_use([&](std::uint32_t, std::uint32_t from, std::uint32_t to) { add_one(start[std::min(from, to) + 1]); });
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
  UnsetVector<EdgeUse> uses(3 * triangles.size());
  for_each_use([&](std::uint32_t t, std::uint32_t from, std::uint32_t to) {
    const std::uint32_t low = std::min(from, to);
    uses[add_one(next[low])] = {std::uint64_t{low} << 32 | std::max(from, to), t, from < to ? std::uint32_t{1} : 0};
  });
  tbb::parallel_for(std::size_t{0}, start.size() - 1, [&](std::size_t v) {
    std::sort(uses.begin() + start[v], uses.begin() + start[v + 1], [](const EdgeUse& a, const EdgeUse& b) {
      return std::tie(a.key, a.triangle, a.forward) < std::tie(b.key, b.triangle, b.forward);
    });
  });
  return uses;
}

DisjointSets::DisjointSets(std::size_t n) : parent_(n) {
  std::iota(parent_.begin(), parent_.end(), 0U);
}

std::uint32_t DisjointSets::find(std::uint32_t i) {
  while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
  return i;
}

void DisjointSets::join(std::uint32_t a, std::uint32_t b) {
  a = find(a);
  b = find(b);
  parent_[std::max(a, b)] = std::min(a, b);
}

Pieces closed_pieces(const std::vector<Triangle>& triangles, std::span<const EdgeUse> uses) {
  DisjointSets sets(triangles.size());
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() == 2) sets.join(edge[0].triangle, edge[1].triangle);
  });
  std::vector<std::uint8_t> open(triangles.size(), 0);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() == 2 && edge_balance(edge) == 0) return;
    for (const EdgeUse& use : edge) {
      int balance = 0;
      for (const EdgeUse& other : edge) {
        if (sets.find(other.triangle) == sets.find(use.triangle)) balance += other.forward != 0 ? 1 : -1;
      }
      if (balance != 0) open[sets.find(use.triangle)] = 1;
    }
  });
  // Joined afterwards, because `open` is looked up by set names that joining would change.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> joins;
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    const EdgeUse* first = nullptr;
    for (const EdgeUse& use : edge) {
      if (edge.size() == 2 || open[sets.find(use.triangle)] == 0) continue;
      if (first != nullptr) joins.emplace_back(first->triangle, use.triangle);
      first = &use;
    }
  });
  for (const auto& [a, b] : joins) sets.join(a, b);
  return number_pieces(sets, triangles.size());
}

Pieces closed_pieces(const std::vector<Triangle>& triangles) {
  return closed_pieces(triangles, sorted_edges(triangles));
}

std::vector<std::uint8_t> open_pieces(const Pieces& pieces, std::span<const EdgeUse> uses) {
  std::vector<std::uint8_t> open(pieces.count, 0);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    for (const EdgeUse& use : edge) {
      const std::uint32_t piece = pieces.of_triangle[use.triangle];
      int balance = 0;
      for (const EdgeUse& other : edge) {
        if (pieces.of_triangle[other.triangle] == piece) balance += other.forward != 0 ? 1 : -1;
      }
      if (balance != 0) open[piece] = 1;
    }
  });
  return open;
}

Pieces pieces_by_vertices(const std::vector<Triangle>& triangles, std::size_t vertices) {
  DisjointSets sets(triangles.size());
  std::vector<std::uint32_t> first(vertices, kNoBrick);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (const std::uint32_t v : triangles[t]) {
      if (first[v] == kNoBrick) first[v] = t;
      sets.join(first[v], t);
    }
  }
  return number_pieces(sets, triangles.size());
}

void drop_unused_vertices(Mesh& mesh) {
  std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) used[v] = 1;
  }
  std::vector<std::uint32_t> number(mesh.vertices.size());
  std::uint32_t kept = 0;
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (used[v] == 0) continue;
    mesh.vertices[kept] = mesh.vertices[v];
    number[v] = kept++;
  }
  mesh.vertices.resize(kept);
  for (Triangle& t : mesh.triangles) {
    for (std::uint32_t& v : t) v = number[v];
  }
}

}  // namespace vps::bake

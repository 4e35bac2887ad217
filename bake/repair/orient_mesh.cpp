// SPDX-License-Identifier: GPL-3.0-or-later
// Breadth-first search over edges with two triangles, then a greedy search that turns whole patches.
#include "bake/repair/orient_mesh.h"

#include <cstdlib>
#include <map>

#include "bake/grid.h"
#include "bake/repair/topology.h"

namespace vps::bake {
namespace {

// A triangle's neighbour across an edge with exactly two uses. They disagree if both run along it in one direction.
struct Neighbour {
  std::uint32_t triangle = kNoBrick;
  bool disagrees = false;
};
using Neighbours = std::vector<std::array<Neighbour, 3>>;

Neighbours find_neighbours(const Mesh& mesh, std::span<const EdgeUse> uses) {
  Neighbours neighbours(mesh.triangles.size());
  const auto add = [&](std::uint32_t to, std::uint32_t neighbour, bool disagrees) {
    for (Neighbour& slot : neighbours[to]) {
      if (slot.triangle != kNoBrick) continue;
      slot = {neighbour, disagrees};
      break;
    }
  };
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() != 2) return;
    const bool disagrees = edge[0].forward == edge[1].forward;
    add(edge[0].triangle, edge[1].triangle, disagrees);
    add(edge[1].triangle, edge[0].triangle, disagrees);
  });
  return neighbours;
}

// Patches are connected by edges with exactly two uses. Within a patch the first triangle decides all turns.
struct Patches {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
};

Patches orient_patches(const Mesh& mesh, const Neighbours& neighbours, std::vector<std::uint8_t>& turned) {
  Patches patches;
  patches.of_triangle.assign(mesh.triangles.size(), kNoBrick);
  std::vector<std::uint32_t> queue;
  for (std::uint32_t first = 0; first < mesh.triangles.size(); ++first) {
    if (patches.of_triangle[first] != kNoBrick) continue;
    queue.assign(1, first);
    patches.of_triangle[first] = patches.count;
    std::size_t turns = 0;
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const std::uint32_t t = queue[at];
      turns += turned[t];
      for (const Neighbour& n : neighbours[t]) {
        if (n.triangle == kNoBrick || patches.of_triangle[n.triangle] != kNoBrick) continue;
        patches.of_triangle[n.triangle] = patches.count;
        turned[n.triangle] = turned[t] ^ static_cast<std::uint8_t>(n.disagrees);
        queue.push_back(n.triangle);
      }
    }
    if (2 * turns > queue.size()) {
      for (const std::uint32_t t : queue) turned[t] ^= 1;
    }
    ++patches.count;
  }
  return patches;
}

// Turns a patch if that reduces the sum of |balance| over its edges with more than two uses.
void balance_patches(std::span<const EdgeUse> uses, const Patches& patches, std::vector<std::uint8_t>& turned) {
  // For each edge with more than two uses: what each patch adds to its balance.
  using Shares = std::map<std::uint32_t, int>;
  std::vector<Shares> edges;
  std::vector<std::vector<std::uint32_t>> edges_of(patches.count);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() <= 2) return;
    Shares shares;
    for (const EdgeUse& use : edge) {
      shares[patches.of_triangle[use.triangle]] += (use.forward ^ turned[use.triangle]) != 0 ? 1 : -1;
    }
    for (const auto& [patch, share] : shares) edges_of[patch].push_back(static_cast<std::uint32_t>(edges.size()));
    edges.push_back(std::move(shares));
  });
  std::vector<std::uint8_t> turn(patches.count, 0);
  bool changed = true;
  for (int round = 0; round < 20 && changed; ++round) {
    changed = false;
    for (std::uint32_t patch = 0; patch < patches.count; ++patch) {
      long gain = 0;
      for (const std::uint32_t e : edges_of[patch]) {
        int balance = 0;
        for (const auto& [other, share] : edges[e]) balance += share;
        gain += std::abs(balance) - std::abs(balance - 2 * edges[e].at(patch));
      }
      if (gain <= 0) continue;
      for (const std::uint32_t e : edges_of[patch]) edges[e].at(patch) *= -1;
      turn[patch] ^= 1;
      changed = true;
    }
  }
  for (std::size_t t = 0; t < turned.size(); ++t) turned[t] ^= turn[patches.of_triangle[t]];
}

}  // namespace

std::size_t orient_consistently(Mesh& mesh) {
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  std::vector<std::uint8_t> turned(mesh.triangles.size(), 0);
  const Patches patches = orient_patches(mesh, find_neighbours(mesh, uses), turned);
  balance_patches(uses, patches, turned);
  std::size_t count = 0;
  for (std::size_t t = 0; t < turned.size(); ++t) {
    if (turned[t] == 0) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    ++count;
  }
  return count;
}

}  // namespace vps::bake

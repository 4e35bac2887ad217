// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Edges and connected pieces of an indexed triangle mesh. Internal to bake.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/geometry.h"
#include "bake/unset_vector.h"

namespace vps::bake {

/// One triangle's use of an edge.
struct EdgeUse {
  std::uint64_t key;       ///< smaller vertex << 32 | larger vertex
  std::uint32_t triangle;  ///< whose edge this is
  std::uint32_t forward;   ///< 1: the triangle runs from the smaller vertex to the larger one, 0: the other way

  [[nodiscard]] std::uint32_t low() const { return static_cast<std::uint32_t>(key >> 32); }
  [[nodiscard]] std::uint32_t high() const { return static_cast<std::uint32_t>(key); }
  [[nodiscard]] std::uint32_t from() const { return forward != 0 ? low() : high(); }
  [[nodiscard]] std::uint32_t to() const { return forward != 0 ? high() : low(); }
};

/// All edge uses, sorted by edge, then by triangle.
[[nodiscard]] UnsetVector<EdgeUse> sorted_edges(const std::vector<Triangle>& triangles);

/// Calls visit(span of uses) once per edge.
template <class Visit>
void for_each_edge(std::span<const EdgeUse> uses, Visit visit) {
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].key == uses[i].key) ++end;
    visit(uses.subspan(i, end - i));
    i = end;
  }
}

/// Uses along the edge minus uses against it. A surface is closed when this is 0 for every edge: its boundary as a
/// chain is zero, and the winding number of every point off the surface is an integer.
[[nodiscard]] inline int edge_balance(std::span<const EdgeUse> edge) {
  int balance = 0;
  for (const EdgeUse& use : edge) balance += use.forward != 0 ? 1 : -1;
  return balance;
}

/// Disjoint sets of numbers 0 to n - 1, named by their smallest member.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n);
  [[nodiscard]] std::uint32_t find(std::uint32_t i);
  void join(std::uint32_t a, std::uint32_t b);

 private:
  std::vector<std::uint32_t> parent_;
};

/// Pieces of a mesh, numbered by their first triangle.
struct Pieces {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
};

/// Triangles that share an edge with exactly two uses belong together. A piece that is not closed then also joins the
/// other open pieces at its edges with more uses. So solids that touch in an edge stay separate.
[[nodiscard]] Pieces closed_pieces(const std::vector<Triangle>& triangles, std::span<const EdgeUse> uses);
[[nodiscard]] Pieces closed_pieces(const std::vector<Triangle>& triangles);

/// One byte per piece: 1 when the piece's own uses of some edge are unbalanced. Other pieces' uses do not count.
[[nodiscard]] std::vector<std::uint8_t> open_pieces(const Pieces& pieces, std::span<const EdgeUse> uses);

/// Triangles that share a vertex belong together.
[[nodiscard]] Pieces pieces_by_vertices(const std::vector<Triangle>& triangles, std::size_t vertices);

/// Keeps the vertices that triangles use, in their order.
void drop_unused_vertices(Mesh& mesh);

}  // namespace vps::bake

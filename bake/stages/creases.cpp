// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/creases.h"

#include <algorithm>
#include <span>

#include "formats/vps_format.h"

namespace vps::bake {
namespace {

// An edge seen from one of its triangles.
struct Side {
  std::uint64_t key;
  double length;  // [m]
  Vector normal;  // unit
};

Vector to_vector(const std::array<double, 3>& p) {
  return {p[0], p[1], p[2]};
}
const Vector& to_vector(const Vector& p) {
  return p;
}

std::uint64_t edge_key(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t ends[2] = {std::min(a, b), std::max(a, b)};
  return hash_bytes(std::as_bytes(std::span(ends)));
}

// Sides of one edge in `stride`. Edges are chosen by their key, so that all sides of an edge are chosen.
template <class Position>
std::vector<Side> choose_sides(const std::vector<Position>& vertices, const std::vector<Triangle>& triangles,
                               std::uint64_t stride) {
  std::vector<std::uint64_t> hashes;
  hashes.reserve(vertices.size());
  for (const Position& v : vertices) {
    const Vector p = to_vector(v) + Vector::Zero();  // -0 and 0 are one position
    hashes.push_back(hash_bytes(std::as_bytes(std::span(p.data(), 3))));
  }
  std::vector<Side> sides;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = k == 2 ? 0 : k + 1;
      const std::uint64_t key = edge_key(hashes[t[k]], hashes[t[next]]);
      if (key % stride != 0) continue;
      const Vector a = to_vector(vertices[t[0]]);
      const Vector normal = (to_vector(vertices[t[1]]) - a).cross(to_vector(vertices[t[2]]) - a).stableNormalized();
      // Skips collapsed triangles, which have no normal.
      if (!(normal.squaredNorm() > 0.5)) continue;
      sides.push_back({key, (to_vector(vertices[t[k]]) - to_vector(vertices[t[next]])).norm(), normal});
    }
  }
  return sides;
}

template <class Position>
Creases measure(const std::vector<Position>& vertices, const std::vector<Triangle>& triangles) {
  // Enough for an error of a few per cent.
  constexpr std::size_t kEnough = 1 << 14;
  const std::uint64_t stride = 1 + 3 * triangles.size() / kEnough;
  std::vector<Side> sides = choose_sides(vertices, triangles, stride);
  std::stable_sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) { return a.key < b.key; });
  Creases creases;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].key == sides[i].key) ++end;
    // Change of the distance's gradient across the edge: 2 sin(angle / 2).
    const double bend = end - i == 2 ? (sides[i].normal - sides[i + 1].normal).norm() : 2;
    const double length = sides[i].length * static_cast<double>(stride);
    // Up to 0.2 the coarsest samples, 2 voxels apart, are good enough near the edge. Beyond 0.8 only the finest are.
    if (bend > 0.8) {
      creases.sharp += length;
    } else if (bend > 0.2) {
      creases.blunt += length;
    }
    i = end;
  }
  return creases;
}

}  // namespace

Creases measure_creases(const TriangleMesh& mesh) {
  return measure(mesh.vertices, mesh.triangles);
}
Creases measure_creases(const Mesh& mesh) {
  return measure(mesh.vertices, mesh.triangles);
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Closed meshes of analytic shapes, made in memory.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "formats/triangle_mesh.h"

namespace vps::test {

/// Box centred on `centre`; 12 triangles.
inline TriangleMesh make_box(std::array<double, 3> half, std::array<double, 3> centre = {0, 0, 0}) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back({centre[0] + ((i & 1) != 0 ? half[0] : -half[0]), centre[1] + ((i & 2) != 0 ? half[1] : -half[1]),
                             centre[2] + ((i & 4) != 0 ? half[2] : -half[2])});
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

/// Subdivided icosahedron with vertices on the sphere; 20 * 4^level triangles.
inline TriangleMesh make_sphere(double radius, int level, std::array<double, 3> centre = {0, 0, 0}) {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0}, {0, -1, g}, {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8}, {3, 9, 4}, {3, 4, 2}, {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9}, {4, 9, 5}, {2, 4, 11}, {6, 2, 10}, {8, 6, 7}, {9, 8, 1}};
  for (int l = 0; l < level; ++l) {
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                   static_cast<std::uint32_t>(mesh.vertices.size()));
      if (fresh) {
        const auto& p = mesh.vertices[a];
        const auto& q = mesh.vertices[b];
        mesh.vertices.push_back({(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2});
      }
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = finer;
  }
  for (auto& v : mesh.vertices) {
    const double scale = radius / std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) v[axis] = v[axis] * scale + centre[axis];
  }
  return mesh;
}

/// Torus around z with `rings` x `sides` quads.
inline TriangleMesh make_torus(double ring_radius, double tube_radius, std::uint32_t rings, std::uint32_t sides) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < rings; ++i) {
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double u = 2 * std::numbers::pi * i / rings;
      const double v = 2 * std::numbers::pi * j / sides;
      const double r = ring_radius + tube_radius * std::cos(v);
      mesh.vertices.push_back({r * std::cos(u), r * std::sin(u), tube_radius * std::sin(v)});
      const std::uint32_t a = i * sides + j;
      const std::uint32_t b = (i + 1) % rings * sides + j;
      const std::uint32_t c = (i + 1) % rings * sides + (j + 1) % sides;
      const std::uint32_t d = i * sides + (j + 1) % sides;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

/// `outer` with `inner` turned inside out: a cavity.
inline TriangleMesh with_cavity(TriangleMesh outer, const TriangleMesh& inner) {
  const auto base = static_cast<std::uint32_t>(outer.vertices.size());
  outer.vertices.insert(outer.vertices.end(), inner.vertices.begin(), inner.vertices.end());
  for (const auto& [a, b, c] : inner.triangles) outer.triangles.push_back({base + a, base + c, base + b});
  return outer;
}

/// Both meshes in one.
inline TriangleMesh joined(TriangleMesh first, const TriangleMesh& second) {
  const auto base = static_cast<std::uint32_t>(first.vertices.size());
  first.vertices.insert(first.vertices.end(), second.vertices.begin(), second.vertices.end());
  for (const auto& [a, b, c] : second.triangles) first.triangles.push_back({base + a, base + b, base + c});
  return first;
}

}  // namespace vps::test

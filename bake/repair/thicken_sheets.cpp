// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/thicken_sheets.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "bake/grid.h"
#include "bake/repair/topology.h"

namespace vps::bake {
namespace {

double angle_at(const Vector& p, const Vector& q, const Vector& r) {
  const Vector a = q - p;
  const Vector b = r - p;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Offset of each vertex of a patch along the mean normal. It is long enough to move the faces by `distance`, but at
// most twice that.
std::unordered_map<std::uint32_t, Vector> vertex_offsets(const Mesh& mesh, const std::vector<std::uint32_t>& patch,
                                                         double distance) {
  std::unordered_map<std::uint32_t, Vector> mean;
  for (const std::uint32_t t : patch) {
    const Vector normal = mesh.area_normal(t).stableNormalized();
    for (int k = 0; k < 3; ++k) {
      const double angle = angle_at(mesh.corner(t, k), mesh.corner(t, (k + 1) % 3), mesh.corner(t, (k + 2) % 3));
      mean.try_emplace(mesh.triangles[t][static_cast<std::size_t>(k)], Vector::Zero()).first->second += angle * normal;
    }
  }
  std::unordered_map<std::uint32_t, double> least_cosine;
  for (auto& [vertex, normal] : mean) normal = normal.stableNormalized();
  for (const std::uint32_t t : patch) {
    const Vector normal = mesh.area_normal(t).stableNormalized();
    for (const std::uint32_t v : mesh.triangles[t]) {
      double& least = least_cosine.try_emplace(v, 1.0).first->second;
      least = std::min(least, normal.dot(mean.at(v)));
    }
  }
  for (auto& [vertex, normal] : mean) normal *= distance / std::max(least_cosine.at(vertex), 0.5);
  return mean;
}

void extrude(const Mesh& mesh, const std::vector<std::uint32_t>& patch, double half, Mesh& out) {
  const std::unordered_map<std::uint32_t, Vector> offsets = vertex_offsets(mesh, patch, half);
  std::unordered_map<std::uint32_t, std::uint32_t> upper;  // the lower copy has the next number
  const auto number = [&](std::uint32_t v) {
    const auto [it, fresh] = upper.try_emplace(v, static_cast<std::uint32_t>(out.vertices.size()));
    if (fresh) {
      out.vertices.push_back(mesh.vertices[v] + offsets.at(v));
      out.vertices.push_back(mesh.vertices[v] - offsets.at(v));
    }
    return it->second;
  };
  std::vector<Triangle> sheet;
  for (const std::uint32_t t : patch) {
    const Triangle& corners = mesh.triangles[t];
    const Triangle top = {number(corners[0]), number(corners[1]), number(corners[2])};
    sheet.push_back(top);
    out.triangles.push_back(top);
    out.triangles.push_back({top[0] + 1, top[2] + 1, top[1] + 1});
  }
  const UnsetVector<EdgeUse> uses = sorted_edges(sheet);
  for_each_edge(std::span(uses), [&](std::span<const EdgeUse> edge) {
    int balance = edge_balance(edge);
    for (; balance != 0; balance += balance > 0 ? -1 : 1) {
      const std::uint32_t from = balance > 0 ? edge.front().low() : edge.front().high();
      const std::uint32_t to = balance > 0 ? edge.front().high() : edge.front().low();
      out.triangles.push_back({to, from, from + 1});
      out.triangles.push_back({to, from + 1, to + 1});
    }
  });
}

}  // namespace

std::size_t thicken_sheets(Mesh& mesh, double thickness) {
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  const Pieces pieces = closed_pieces(mesh.triangles, uses);
  const std::vector<std::uint8_t> open = open_pieces(pieces, uses);
  DisjointSets sets(mesh.triangles.size());
  for_each_edge(std::span(uses), [&](std::span<const EdgeUse> edge) {
    if (edge_balance(edge) == 0 && edge.size() == 2) sets.join(edge[0].triangle, edge[1].triangle);
  });
  std::vector<std::vector<std::uint32_t>> patches(mesh.triangles.size());
  Mesh out;
  out.vertices = mesh.vertices;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (open[pieces.of_triangle[t]] == 0) {
      out.triangles.push_back(mesh.triangles[t]);
    } else if (!mesh.area_normal(t).isZero(0)) {
      patches[sets.find(t)].push_back(t);
    }
  }
  for (const std::vector<std::uint32_t>& patch : patches) {
    if (!patch.empty()) extrude(mesh, patch, thickness / 2, out);
  }
  drop_unused_vertices(out);
  mesh = std::move(out);
  return static_cast<std::size_t>(std::count(open.begin(), open.end(), 1));
}

}  // namespace vps::bake

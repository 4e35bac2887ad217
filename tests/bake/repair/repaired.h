// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Meshes with faults, and what their repair gives.
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bake/repair/check.h"
#include "bake/repair/topology.h"
#include "bake/stages/mass_properties.h"
#include "tests/bake/scene.h"

namespace vps::test {

using namespace bake;

struct Repaired {
  Surface surface;
  RepairOutcome outcome;
  double volume = 0;
};

inline Repaired repaired(const TriangleMesh& mesh, const RepairSettings& settings = {}) {
  Repaired r;
  r.surface = check_mesh(mesh, settings, r.outcome);
  r.volume = mass_properties(r.surface).volume;
  return r;
}

inline std::string repair_refusal(const TriangleMesh& mesh, const RepairSettings& settings) {
  RepairOutcome outcome;
  try {
    (void)check_mesh(mesh, settings, outcome);
  } catch (const BakeError& error) {
    return error.what();
  }
  return "";
}

inline RepairSettings with(Repair repair, double voxel_size = 0.05) {
  return {repair, voxel_size, 0};
}

inline TriangleMesh inside_out(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

// Each triangle with its own corners, moved by up to gap / 2 along each axis.
inline TriangleMesh shaken(const TriangleMesh& mesh, double gap) {
  TriangleMesh soup;
  Random random;
  for (const auto& t : mesh.triangles) {
    const auto base = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t v : t) {
      std::array<double, 3> p = mesh.vertices[v];
      for (double& x : p) x += gap * (random.next() - 0.5);
      soup.vertices.push_back(p);
    }
    soup.triangles.push_back({base, base + 1, base + 2});
  }
  return soup;
}

inline TriangleMesh without(TriangleMesh mesh, std::size_t first, std::size_t count) {
  const auto begin = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(first);
  mesh.triangles.erase(begin, begin + static_cast<std::ptrdiff_t>(count));
  return mesh;
}

// A one-sided rectangle perpendicular to z.
inline TriangleMesh make_sheet(double half_x, double half_y, std::array<double, 3> centre) {
  const auto& [x, y, z] = centre;
  return {{{x - half_x, y - half_y, z},
           {x + half_x, y - half_y, z},
           {x + half_x, y + half_y, z},
           {x - half_x, y + half_y, z}},
          {{0, 1, 2}, {0, 2, 3}}};
}

inline bool is_closed(const Mesh& mesh) {
  const UnsetVector<EdgeUse> uses = sorted_edges(mesh.triangles);
  bool closed = true;
  for_each_edge(std::span(uses), [&](std::span<const EdgeUse> edge) { closed = closed && edge_balance(edge) == 0; });
  return closed;
}

}  // namespace vps::test

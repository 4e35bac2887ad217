// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/resolve_shells.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "bake/grid.h"
#include "bake/repair/topology.h"
#include "bake/repair/unite_shells.h"
#include "bake/repair/winding.h"

namespace vps::bake {
namespace {

// Six times the signed volume. Taken about a corner of the mesh, which keeps digits far from the origin.
double signed_volume6(const Mesh& mesh) {
  const Vector reference = mesh.corner(0, 0);
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    sum += (mesh.corner(t, 0) - reference).dot((mesh.corner(t, 1) - reference).cross(mesh.corner(t, 2) - reference));
  }
  return sum;
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += mesh.area_normal(t).norm() / 2;
  return sum;
}

bool encloses_volume(const Mesh& mesh) {
  const double a = area(mesh);
  return std::abs(signed_volume6(mesh)) > 1e-12 * a * std::sqrt(a);
}

void turn(Mesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

Mesh part_of(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  Mesh part;
  part.vertices = mesh.vertices;
  part.triangles.reserve(triangles.size());
  for (const std::uint32_t t : triangles) part.triangles.push_back(mesh.triangles[t]);
  drop_unused_vertices(part);
  return part;
}

void append(Mesh& mesh, const Mesh& part) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), part.vertices.begin(), part.vertices.end());
  for (const Triangle& t : part.triangles) mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

// Shells that meet, directly or through others.
struct Group {
  std::vector<std::uint32_t> shells;
  std::vector<TrianglePair> pairs;  // triangles of the whole mesh
};

// Unites the shells of a group. Turns shells of negative volume first if all have one, or if some winding number would
// be negative otherwise.
Mesh unite_group(const Mesh& mesh, const std::vector<std::vector<std::uint32_t>>& shells, const Group& group,
                 ShellCounts& counts) {
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> number(mesh.triangles.size(), kNoBrick);
  std::vector<std::uint8_t> inverted(mesh.triangles.size(), 0);
  std::uint32_t inside_out = 0;
  for (const std::uint32_t shell : group.shells) {
    const bool turned = signed_volume6(part_of(mesh, shells[shell])) < 0;
    inside_out += turned;
    for (const std::uint32_t t : shells[shell]) {
      number[t] = static_cast<std::uint32_t>(triangles.size());
      triangles.push_back(t);
      inverted[t] = turned;
    }
  }
  std::vector<TrianglePair> pairs;
  pairs.reserve(group.pairs.size());
  for (const auto& [a, b] : group.pairs) {
    pairs.emplace_back(std::min(number[a], number[b]), std::max(number[a], number[b]));
  }
  std::sort(pairs.begin(), pairs.end());
  const Mesh part = part_of(mesh, triangles);
  if (inside_out < group.shells.size()) {
    UnitedShells united = unite_shells(part, pairs);
    // If no winding number is negative, an inward shell is a cavity that touches the wall around it.
    if (united.least_winding >= 0 || inside_out == 0) return united.mesh;
  }
  counts.inverted += inside_out;
  Mesh righted = part;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (inverted[triangles[i]] != 0) std::swap(righted.triangles[i][1], righted.triangles[i][2]);
  }
  return unite_shells(righted, pairs).mesh;
}

// A point of the mesh that no other group shares: the middle of its largest triangle.
Vector own_point(const Mesh& mesh) {
  std::size_t largest = 0;
  for (std::size_t t = 1; t < mesh.triangles.size(); ++t) {
    if (mesh.area_normal(t).squaredNorm() > mesh.area_normal(largest).squaredNorm()) largest = t;
  }
  return (mesh.corner(largest, 0) + mesh.corner(largest, 1) + mesh.corner(largest, 2)) / 3;
}

// Counts the other groups that a group lies inside of. Groups meet at most in vertices and edges.
class Nesting {
 public:
  explicit Nesting(const std::vector<Mesh>& groups) {
    for (std::uint32_t g = 0; g < groups.size(); ++g) {
      append(all_, groups[g]);
      of_triangle_.resize(all_.triangles.size(), g);
    }
    grid_ = column_grid(all_);
    lines_ = std::make_unique<InsideTest>(all_, grid_);
  }

  [[nodiscard]] std::uint32_t depth(std::uint32_t group, const Vector& point) const {
    std::vector<int> winding(of_triangle_.back() + 1, 0);
    lines_->for_each_crossing(point, [&](std::uint32_t t, int crossing) {
      if (of_triangle_[t] != group && crossing_is_beyond(point, all_, t)) winding[of_triangle_[t]] -= crossing;
    });
    return static_cast<std::uint32_t>(std::count_if(winding.begin(), winding.end(), [](int w) { return w != 0; }));
  }

 private:
  Mesh all_;
  std::vector<std::uint32_t> of_triangle_;
  Grid grid_;
  std::unique_ptr<InsideTest> lines_;
};

}  // namespace

ShellCounts resolve_shells(Mesh& mesh, const std::vector<TrianglePair>& pairs) {
  ShellCounts counts;
  counts.intersections = pairs.size();
  const Pieces pieces = closed_pieces(mesh.triangles, sorted_edges(mesh.triangles));
  counts.shells = pieces.count;
  if (pieces.count == 1 && pairs.empty()) {
    if (signed_volume6(mesh) < 0) {
      turn(mesh);
      counts.inverted = 1;
    }
    return counts;
  }
  std::vector<std::vector<std::uint32_t>> shells(pieces.count);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) shells[pieces.of_triangle[t]].push_back(t);

  DisjointSets sets(pieces.count);
  std::vector<std::uint8_t> meets(pieces.count, 0);
  for (const auto& [a, b] : pairs) {
    sets.join(pieces.of_triangle[a], pieces.of_triangle[b]);
    meets[pieces.of_triangle[a]] = meets[pieces.of_triangle[b]] = 1;
  }
  std::vector<Group> groups(pieces.count);
  for (std::uint32_t s = 0; s < pieces.count; ++s) groups[sets.find(s)].shells.push_back(s);
  for (const auto& pair : pairs) groups[sets.find(pieces.of_triangle[pair.first])].pairs.push_back(pair);

  std::vector<Mesh> solids;
  for (const Group& group : groups) {
    if (group.shells.empty()) continue;
    Mesh solid;
    if (group.pairs.empty()) {
      solid = part_of(mesh, shells[group.shells.front()]);
    } else {
      solid = unite_group(mesh, shells, group, counts);
      counts.united += static_cast<std::uint32_t>(group.shells.size());
    }
    if (solid.triangles.empty() || !encloses_volume(solid)) {
      counts.flat += static_cast<std::uint32_t>(group.shells.size());
      continue;
    }
    solids.push_back(std::move(solid));
  }
  if (solids.size() > 1) {
    const Nesting nesting(solids);
    for (std::uint32_t g = 0; g < solids.size(); ++g) {
      const bool cavity = nesting.depth(g, own_point(solids[g])) % 2 != 0;
      counts.nested += cavity;
      const bool inward = signed_volume6(solids[g]) < 0;
      if (inward == cavity) continue;
      turn(solids[g]);
      counts.inverted += !cavity;
    }
  } else if (solids.size() == 1 && signed_volume6(solids[0]) < 0) {
    turn(solids[0]);
    counts.inverted += 1;
  }
  mesh = Mesh{};
  for (const Mesh& solid : solids) append(mesh, solid);
  return counts;
}

}  // namespace vps::bake

// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/repair/resolve_shells.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "bake/grid.h"
#include "bake/repair/topology.h"
#include "bake/repair/unite_shells.h"
#include "bake/repair/winding.h"

namespace vps::bake {
namespace {

// Folds of scans enclose smaller parts that are inside out.
constexpr double kLargePart = 0.01;

// Six times the signed volume of a triangle's tetrahedron. A reference on the mesh keeps digits far from the origin.
double volume6_of(const Mesh& mesh, std::size_t t, const Vector& reference) {
  return (mesh.corner(t, 0) - reference).dot((mesh.corner(t, 1) - reference).cross(mesh.corner(t, 2) - reference));
}

double signed_volume6(const Mesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += volume6_of(mesh, t, mesh.corner(0, 0));
  return sum;
}

double signed_volume6(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  double sum = 0;
  for (const std::uint32_t t : triangles) sum += volume6_of(mesh, t, mesh.corner(triangles.front(), 0));
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

// Takes time in the size of the part alone: a mesh may have thousands of shells.
Mesh part_of(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  if (triangles.size() == mesh.triangles.size() && std::is_sorted(triangles.begin(), triangles.end())) {
    Mesh whole = mesh;
    drop_unused_vertices(whole);
    return whole;
  }
  std::vector<std::uint32_t> used;
  used.reserve(3 * triangles.size());
  for (const std::uint32_t t : triangles) used.insert(used.end(), mesh.triangles[t].begin(), mesh.triangles[t].end());
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const auto number = [&](std::uint32_t v) {
    return static_cast<std::uint32_t>(std::lower_bound(used.begin(), used.end(), v) - used.begin());
  };
  Mesh part;
  part.vertices.reserve(used.size());
  for (const std::uint32_t v : used) part.vertices.push_back(mesh.vertices[v]);
  part.triangles.reserve(triangles.size());
  for (const std::uint32_t t : triangles) {
    const auto& [a, b, c] = mesh.triangles[t];
    part.triangles.push_back({number(a), number(b), number(c)});
  }
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
  std::vector<TrianglePair> pairs;  // of the group's triangles, numbered in the order of its shells
};

Mesh unite_group(const Mesh& mesh, const std::vector<std::vector<std::uint32_t>>& shells, Group& group,
                 ShellCounts& counts) {
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint8_t> inward;
  std::uint32_t inside_out = 0;
  double volume = 0, if_righted = 0;
  for (const std::uint32_t shell : group.shells) {
    const double own = signed_volume6(mesh, shells[shell]);
    const bool turned = own < 0;
    volume += own;
    if_righted += std::abs(own);
    inside_out += turned;
    triangles.insert(triangles.end(), shells[shell].begin(), shells[shell].end());
    inward.resize(triangles.size(), turned);
  }
  std::sort(group.pairs.begin(), group.pairs.end());
  Mesh part = part_of(mesh, triangles);
  UnitedShells united = unite_shells(part, group.pairs, inward);
  if (united.righted) {
    counts.inverted += inside_out;
    volume = if_righted;
    for (std::size_t t = 0; t < inward.size(); ++t) {
      if (inward[t] != 0) std::swap(part.triangles[t][1], part.triangles[t][2]);
    }
  }
  if (united.mesh.triangles.empty()) return std::move(united.mesh);
  // A union is no larger than the sum of its shells, but for parts that the sum subtracts.
  const double kept = signed_volume6(united.mesh);
  const double lost = (kept - volume) / kept;
  if (lost < kLargePart) {
    counts.left_out = std::max(counts.left_out, lost);
    return std::move(united.mesh);
  }
  counts.righted = std::max(counts.righted, lost);
  // Turned as a whole, the mesh has positive winding numbers in these parts.
  turn(part);
  const auto unite = [](const Mesh& of, const std::vector<TrianglePair>& pairs) {
    return unite_shells(of, pairs, std::vector<std::uint8_t>(of.triangles.size(), 0)).mesh;
  };
  append(united.mesh, unite(part, group.pairs));
  return unite(united.mesh, self_intersections(united.mesh));
}

// A point of the mesh that no other group shares: the middle of its largest triangle.
Vector own_point(const Mesh& mesh) {
  std::size_t largest = 0;
  for (std::size_t t = 1; t < mesh.triangles.size(); ++t) {
    if (mesh.area_normal(t).squaredNorm() > mesh.area_normal(largest).squaredNorm()) largest = t;
  }
  return (mesh.corner(largest, 0) + mesh.corner(largest, 1) + mesh.corner(largest, 2)) / 3;
}

// Finds the other groups that a group lies inside of. Groups meet at most in vertices and edges.
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

  // The groups around a group's point, with their winding numbers there.
  [[nodiscard]] std::map<std::uint32_t, int> around(std::uint32_t group, const Vector& point) const {
    std::map<std::uint32_t, int> winding;  // of the groups that the line crosses
    lines_->for_each_crossing(point, [&](std::uint32_t t, int crossing) {
      if (of_triangle_[t] != group && crossing_is_beyond(point, all_, t)) winding[of_triangle_[t]] -= crossing;
    });
    std::erase_if(winding, [](const auto& w) { return w.second == 0; });
    return winding;
  }

 private:
  Mesh all_;
  std::vector<std::uint32_t> of_triangle_;
  Grid grid_;
  std::unique_ptr<InsideTest> lines_;
};

// The inward wall of a cavity and outward shells that meet it, such as a boss inside a housing, are united with the
// solid around them, all as they are wound. By themselves they would be a cavity larger by the boss.
void join_bosses(const Mesh& mesh, const std::vector<std::vector<std::uint32_t>>& shells,
                 const std::vector<Group>& groups, DisjointSets& sets) {
  std::vector<double> volumes;
  for (const std::vector<std::uint32_t>& shell : shells) volumes.push_back(signed_volume6(mesh, shell));
  const auto is_smaller = [&](std::uint32_t a, std::uint32_t b) { return std::abs(volumes[a]) < std::abs(volumes[b]); };
  std::vector<std::uint32_t> walls;  // the largest shells of such groups
  for (const Group& group : groups) {
    if (group.shells.size() < 2) continue;
    const std::uint32_t largest = *std::max_element(group.shells.begin(), group.shells.end(), is_smaller);
    const bool has_boss =
        std::any_of(group.shells.begin(), group.shells.end(), [&](std::uint32_t s) { return volumes[s] > 0; });
    if (volumes[largest] < 0 && has_boss) walls.push_back(largest);
  }
  if (walls.empty()) return;
  std::vector<Mesh> parts(groups.size());
  for (std::uint32_t s = 0; s < shells.size(); ++s) append(parts[sets.find(s)], part_of(mesh, shells[s]));
  const Nesting nesting(parts);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  for (const std::uint32_t wall : walls) {
    const auto around = nesting.around(sets.find(wall), own_point(part_of(mesh, shells[wall])));
    const auto closest = std::min_element(around.begin(), around.end(), [&](const auto& a, const auto& b) {
      return std::abs(signed_volume6(parts[a.first])) < std::abs(signed_volume6(parts[b.first]));
    });
    if (closest != around.end() && closest->second > 0) found.emplace_back(wall, closest->first);
  }
  for (const auto& [wall, solid] : found) sets.join(wall, solid);
}

}  // namespace

ShellCounts resolve_shells(Mesh& mesh, const std::vector<TrianglePair>& pairs, const Pieces& pieces) {
  ShellCounts counts;
  counts.intersections = pairs.size();
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
  const auto make_groups = [&] {
    std::vector<Group> groups(pieces.count);
    for (std::uint32_t s = 0; s < pieces.count; ++s) groups[sets.find(s)].shells.push_back(s);
    return groups;
  };
  join_bosses(mesh, shells, make_groups(), sets);
  std::vector<Group> groups = make_groups();
  std::vector<std::uint32_t> number(mesh.triangles.size());
  for (const Group& group : groups) {
    std::uint32_t next = 0;
    for (const std::uint32_t s : group.shells) {
      for (const std::uint32_t t : shells[s]) number[t] = next++;
    }
  }
  for (const auto& [a, b] : pairs) {
    groups[sets.find(pieces.of_triangle[a])].pairs.emplace_back(std::minmax(number[a], number[b]));
  }

  std::vector<Mesh> solids;
  for (Group& group : groups) {
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
      const bool cavity = nesting.around(g, own_point(solids[g])).size() % 2 != 0;
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

// SPDX-License-Identifier: GPL-3.0-or-later
// Mesh check: everything later stages rely on is established here.
#include "bake/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "bake/vps_bake.h"

namespace vps {
namespace {

[[noreturn]] void refuse(const std::string& message) {
  throw BakeError("check", message);
}

std::string place(const Vector& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g}) m", p.x(), p.y(), p.z());
}

struct PositionHash {
  std::size_t operator()(const std::array<double, 3>& p) const {
    return static_cast<std::size_t>(hash_bytes(std::as_bytes(std::span(p))));
  }
};

void join_vertices(const TriangleMesh& mesh, Surface& surface) {
  std::unordered_map<std::array<double, 3>, std::uint32_t, PositionHash> numbers;
  numbers.reserve(mesh.vertices.size());
  surface.triangles.reserve(mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    Triangle joined{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (triangle[k] >= mesh.vertices.size())
        refuse("a triangle refers to a vertex that is not there; export it again");
      std::array<double, 3> p = mesh.vertices[triangle[k]];
      for (double& x : p) {
        if (!std::isfinite(x)) refuse(fmt::format("vertex {} is not finite; export the mesh again", triangle[k]));
        x += 0.0;  // -0 and 0 are one position
      }
      const auto [it, fresh] = numbers.try_emplace(p, static_cast<std::uint32_t>(surface.vertices.size()));
      if (fresh) surface.vertices.emplace_back(p[0], p[1], p[2]);
      joined[k] = it->second;
    }
    surface.triangles.push_back(joined);
  }
}

// A surface bounds a solid when every edge is used equally often in both directions: its boundary as a chain is zero,
// and the winding number of every point off the surface is an integer.
void check_closed(const Surface& surface) {
  struct Edge {
    std::uint64_t key;
    std::int32_t direction;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * surface.triangles.size());
  for (const Triangle& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = t[k];
      const std::uint32_t to = t[(k + 1) % 3];
      edges.push_back({std::uint64_t{std::min(from, to)} << 32 | std::max(from, to), from < to ? 1 : -1});
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.key < b.key; });
  std::size_t open = 0;
  std::size_t inconsistent = 0;
  Vector first = Vector::Zero();
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i;
    int balance = 0;
    for (; end < edges.size() && edges[end].key == edges[i].key; ++end) balance += edges[end].direction;
    if (balance != 0) {
      if (open + inconsistent == 0) {
        first = (surface.vertices[edges[i].key >> 32] + surface.vertices[edges[i].key & 0xFFFFFFFFu]) / 2;
      }
      ++((end - i) % 2 != 0 ? open : inconsistent);
    }
    i = end;
  }
  if (open > 0) {
    refuse(fmt::format("the mesh is open: {} edges have triangles on one side only, the first at {}; close the holes",
                       open, place(first)));
  }
  if (inconsistent > 0) {
    refuse(
        fmt::format("neighbouring triangles are wound in opposite directions at {} edges, the first at {}; "
                    "make the winding consistent",
                    inconsistent, place(first)));
  }
}

std::size_t drop_collapsed(Surface& surface) {
  const std::size_t before = surface.triangles.size();
  std::erase_if(surface.triangles, [&](const Triangle& t) {
    const Vector n =
        (surface.vertices[t[1]] - surface.vertices[t[0]]).cross(surface.vertices[t[2]] - surface.vertices[t[0]]);
    return !(n.squaredNorm() > 0);
  });
  return before - surface.triangles.size();
}

// Dropped triangles may leave vertices that nothing uses; bounds and mass must not see them.
void drop_unused(Surface& surface) {
  std::vector<std::uint32_t> number(surface.vertices.size(), kNoBrick);
  std::vector<Vector> used;
  for (Triangle& t : surface.triangles) {
    for (std::uint32_t& v : t) {
      if (number[v] == kNoBrick) {
        number[v] = static_cast<std::uint32_t>(used.size());
        used.push_back(surface.vertices[v]);
      }
      v = number[v];
    }
  }
  surface.vertices = std::move(used);
}

// Six times the signed volume, about the bounding box's centre to keep digits far from the origin.
double signed_volume6(const Surface& surface) {
  const Vector middle = (surface.bounds_min + surface.bounds_max) / 2;
  double sum = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    sum += (surface.corner(t, 0) - middle).dot((surface.corner(t, 1) - middle).cross(surface.corner(t, 2) - middle));
  }
  return sum;
}

void measure(Surface& surface) {
  surface.bounds_min = surface.bounds_max = surface.vertices.front();
  for (const Vector& v : surface.vertices) {
    surface.bounds_min = surface.bounds_min.cwiseMin(v);
    surface.bounds_max = surface.bounds_max.cwiseMax(v);
  }
  surface.normals.resize(surface.triangles.size());
  surface.area = 0;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vector n = (surface.corner(t, 1) - surface.corner(t, 0)).cross(surface.corner(t, 2) - surface.corner(t, 0));
    surface.area += n.norm() / 2;
    // stableNormalized: the squares of a 10 um mesh's areas would underflow nothing, but slivers' may.
    surface.normals[t] = n.stableNormalized();
  }
}

}  // namespace

Surface check_mesh(const TriangleMesh& mesh, std::vector<std::string>& notes) {
  Surface surface;
  join_vertices(mesh, surface);
  std::erase_if(surface.triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
  std::size_t collapsed = mesh.triangles.size() - surface.triangles.size();
  if (surface.triangles.empty()) refuse("the mesh has no triangle with an area; check the export");
  check_closed(surface);
  collapsed += drop_collapsed(surface);
  if (surface.triangles.empty()) refuse("the mesh has no triangle with an area; check the export");
  if (collapsed > 0) notes.push_back(fmt::format("dropped {} collapsed triangles", collapsed));
  drop_unused(surface);
  measure(surface);

  const Vector size = surface.bounds_max - surface.bounds_min;
  const double volume6 = signed_volume6(surface);
  if (!(std::abs(volume6) > 1e-12 * surface.area * size.maxCoeff())) {
    refuse("the mesh encloses no volume; give it thickness");
  }
  if (volume6 < 0) {
    for (Triangle& t : surface.triangles) std::swap(t[1], t[2]);
    for (Vector& n : surface.normals) n = -n;
    notes.emplace_back("the mesh was inside out; its winding was reversed");
  }
  return surface;
}

}  // namespace vps

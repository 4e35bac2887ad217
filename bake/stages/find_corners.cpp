// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/find_corners.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace vps::bake {
namespace {

// The normals around a vertex, weighed by the triangles' angles there.
class NormalSpread {
 public:
  // @param normal  unit
  void add(const Vector& normal, double weight) {
    sum_ += weight * normal;
    squares_ += weight * normal * normal.transpose();
    whole_ += weight;
  }
  [[nodiscard]] Vector mean() const { return sum_.normalized(); }
  // How far the normals turn to the side, in the direction in which they do so least.
  [[nodiscard]] double least_across() const {
    const double length = sum_.norm();
    if (!(length > 1e-6 * whole_)) return 0;
    const Vector u = sum_.unitOrthogonal();
    const Vector v = sum_.cross(u) / length;
    // The smaller eigenvalue across the mean normal.
    const double along_u = u.dot(squares_ * u);
    const double along_v = v.dot(squares_ * v);
    const double both = u.dot(squares_ * v);
    return ((along_u + along_v) / 2 - std::hypot((along_u - along_v) / 2, both)) / whole_;
  }

 private:
  Vector sum_ = Vector::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double whole_ = 0;
};

// Whether the surface falls away from a place. @param way  from the place to another one of the surface
bool falls(const Vector& way, const Vector& out) {
  constexpr double kLevel = 0.1;
  return way.dot(out) <= kLevel * way.norm();
}

// The triangles around a vertex.
struct Fan {
  std::uint32_t vertex;
  NormalSpread spread;
  std::vector<Vector> edges;
};

}  // namespace

std::vector<Corner> find_corners(const Surface& surface) {
  constexpr double kTurned = 0.9;  // at a corner some normals differ by more
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> first(surface.vertices.size(), kNone);  // triangle of each vertex
  std::vector<std::uint32_t> fan_of(surface.vertices.size(), kNone);
  std::vector<Fan> fans;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    for (const std::uint32_t v : surface.triangles[t]) {
      if (first[v] == kNone) first[v] = t;
      if (fan_of[v] != kNone || surface.normals[t].dot(surface.normals[first[v]]) > kTurned) continue;
      fan_of[v] = static_cast<std::uint32_t>(fans.size());
      fans.push_back({v, {}, {}});
    }
  }
  if (fans.empty()) return {};
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& at = surface.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) {
      if (fan_of[at[i]] == kNone) continue;
      Fan& fan = fans[fan_of[at[i]]];
      const Vector a = surface.vertices[at[(i + 1) % 3]] - surface.vertices[at[i]];
      const Vector b = surface.vertices[at[(i + 2) % 3]] - surface.vertices[at[i]];
      fan.spread.add(surface.normals[t], std::atan2(a.cross(b).norm(), a.dot(b)));
      fan.edges.push_back(a);
    }
  }
  std::vector<Corner> corners;
  for (const Fan& fan : fans) {
    const Vector out = fan.spread.mean();
    const bool is_convex =
        std::all_of(fan.edges.begin(), fan.edges.end(), [&](const Vector& edge) { return falls(edge, out); });
    const double sharp = is_convex ? fan.spread.least_across() : 0;
    if (sharp > kCorner) corners.push_back({surface.vertices[fan.vertex], first[fan.vertex], sharp});
  }
  return corners;
}

}  // namespace vps::bake

// SPDX-License-Identifier: Zlib
/// @file Closed meshes of simple shapes, wound outward. Lengths in metres.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "formats/triangle_mesh.h"

namespace vps::samples {

using Point = std::array<double, 3>;
using Ring = std::vector<Point>;

/// Box centred on `centre`; 12 triangles.
inline TriangleMesh make_box(std::array<double, 3> half, std::array<double, 3> centre = {0, 0, 0}) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back({centre[0] + ((i & 1) != 0 ? half[0] : -half[0]),
                             centre[1] + ((i & 2) != 0 ? half[1] : -half[1]),
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
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int l = 0; l < level; ++l) {
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<std::uint32_t>(mesh.vertices.size()));
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

/// Radius of an outline in polar coordinates, counter-clockwise.
using Outline = std::function<double(double angle)>;

/// Ring of `count` points at height z.
inline Ring make_ring(std::uint32_t count, double z, const Outline& radius) {
  Ring ring;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    ring.push_back({radius(angle) * std::cos(angle), radius(angle) * std::sin(angle), z});
  }
  return ring;
}

/// Joins consecutive rings of equal length by quads. Rings run counter-clockwise seen from +z. Successive rings of an
/// outer wall go towards +z, those of an inner wall towards -z.
/// @param closed  the last ring is joined to the first (a ring-like body); otherwise both ends get a cap
inline TriangleMesh make_skin(const std::vector<Ring>& rings, bool closed) {
  TriangleMesh mesh;
  const auto count = static_cast<std::uint32_t>(rings.front().size());
  for (const Ring& ring : rings) mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  const auto rows = static_cast<std::uint32_t>(rings.size());
  for (std::uint32_t row = 0; row < (closed ? rows : rows - 1); ++row) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t a = row * count + i;
      const std::uint32_t b = row * count + (i + 1) % count;
      const std::uint32_t c = (row + 1) % rows * count + (i + 1) % count;
      const std::uint32_t d = (row + 1) % rows * count + i;
      mesh.triangles.push_back({a, b, c});
      mesh.triangles.push_back({a, c, d});
    }
  }
  if (closed) return mesh;
  const auto bottom = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.push_back({0, 0, rings.front()[0][2]});
  mesh.vertices.push_back({0, 0, rings.back()[0][2]});
  for (std::uint32_t i = 0; i < count; ++i) {
    mesh.triangles.push_back({bottom, (i + 1) % count, i});
    mesh.triangles.push_back({bottom + 1, (rows - 1) * count + i, (rows - 1) * count + (i + 1) % count});
  }
  return mesh;
}

inline Outline circle(double radius) {
  return [radius](double) { return radius; };
}

/// Regular polygon with a flat side facing angle 0, by the radius of its inscribed circle.
inline Outline polygon(int sides, double inner_radius) {
  const double sector = 2 * std::numbers::pi / sides;
  return [=](double angle) { return inner_radius / std::cos(std::remainder(angle, sector)); };
}

/// Thread: a triangular ridge that climbs one pitch per turn.
struct Thread {
  double minor_radius, depth, pitch;
  [[nodiscard]] Outline at(double z, double clearance) const {
    return [thread = *this, z, clearance](double angle) {
      const double turns = z / thread.pitch - angle / (2 * std::numbers::pi);
      const double ridge = 1 - 2 * std::abs(turns - std::floor(turns) - 0.5);
      return thread.minor_radius + thread.depth * ridge + clearance;
    };
  }
};
inline constexpr Thread kM10{0.00408, 0.00092, 0.0015};
/// Between bolt and nut, along the radius.
inline constexpr double kThreadClearance = 0.00015;
inline constexpr std::uint32_t kRowsPerPitch = 8;
inline constexpr std::uint32_t kAround = 36;  // a multiple of 12: hexagon corners fall on vertices

/// A prism with n sides about the y axis.
inline TriangleMesh make_wheel(double radius, double half_width, std::uint32_t sides) {
  TriangleMesh mesh;
  for (const double y : {-half_width, half_width}) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.push_back({radius * std::sin(angle), y, radius * std::cos(angle)});
    }
  }
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t next = (i + 1) % sides;
    mesh.triangles.push_back({i, next, sides + next});
    mesh.triangles.push_back({i, sides + next, sides + i});
    if (i < 2) continue;
    mesh.triangles.push_back({0, i, i - 1});
    mesh.triangles.push_back({sides, sides + i - 1, sides + i});
  }
  return mesh;
}

/// Hexagon head of 6.4 mm below z = 0, ten turns of thread above it.
inline TriangleMesh make_bolt() {
  std::vector<Ring> rings = {make_ring(kAround, -0.0064, polygon(6, 0.008)), make_ring(kAround, 0, polygon(6, 0.008))};
  for (std::uint32_t row = 0; row <= 10 * kRowsPerPitch; ++row) {
    const double z = kM10.pitch * row / kRowsPerPitch;
    rings.push_back(make_ring(kAround, z, kM10.at(z, 0)));
  }
  return make_skin(rings, false);
}

/// Hexagon nut of five turns from z = 3 mm, in its place on the bolt.
inline TriangleMesh make_nut() {
  const std::uint32_t first = 2 * kRowsPerPitch;
  const std::uint32_t last = 7 * kRowsPerPitch;
  const auto height = [](std::uint32_t row) { return kM10.pitch * row / kRowsPerPitch; };
  std::vector<Ring> rings = {make_ring(kAround, height(first), polygon(6, 0.008)),
                             make_ring(kAround, height(last), polygon(6, 0.008))};
  for (std::uint32_t row = last;; --row) {
    rings.push_back(make_ring(kAround, height(row), kM10.at(height(row), kThreadClearance)));
    if (row == first) break;
  }
  return make_skin(rings, true);
}

/// Spur gear with 20 trapezoid teeth, module 2 mm, 8 mm thick, bore of 10 mm.
inline TriangleMesh make_gear() {
  constexpr int kTeeth = 20;
  const Outline teeth = [](double angle) {
    const double tooth = angle * kTeeth / (2 * std::numbers::pi);
    const double from_middle = 2 * std::abs(tooth - std::floor(tooth) - 0.5);  // 0 on the tip, 1 in the gap
    return from_middle < 0.3 ? 0.022 : from_middle > 0.7 ? 0.0175 : 0.022 - (from_middle - 0.3) / 0.4 * 0.0045;
  };
  constexpr std::uint32_t kPoints = kTeeth * 8;
  return make_skin({make_ring(kPoints, 0, teeth), make_ring(kPoints, 0.008, teeth),
                    make_ring(kPoints, 0.008, circle(0.005)), make_ring(kPoints, 0, circle(0.005))},
                   true);
}

inline constexpr std::uint32_t kPegPoints = 64;

/// Cylinder of 3.9 mm radius, 30 mm long.
inline TriangleMesh make_peg() {
  return make_skin({make_ring(kPegPoints, 0, circle(0.0039)), make_ring(kPegPoints, 0.03, circle(0.0039))}, false);
}

/// Block of 20 x 20 x 20 mm with a through hole whose flats are 4 mm from the axis: 0.1 mm clear of the peg.
inline TriangleMesh make_hole() {
  const double pi = std::numbers::pi;
  const Outline hole = circle(0.004 / std::cos(pi / kPegPoints));
  return make_skin({make_ring(kPegPoints, 0, polygon(4, 0.01)), make_ring(kPegPoints, 0.02, polygon(4, 0.01)),
                    make_ring(kPegPoints, 0.02, hole), make_ring(kPegPoints, 0, hole)},
                   true);
}

}  // namespace vps::samples

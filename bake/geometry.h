// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Vectors, the checked surface and the closest point on a triangle. Internal to bake.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace vps {

using Vector = Eigen::Vector3d;
using Triangle = std::array<std::uint32_t, 3>;

/// Triangles on numbered vertices, of any quality. Metres, asset frame.
struct Mesh {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;

  [[nodiscard]] const Vector& corner(std::size_t triangle, int k) const {
    return vertices[triangles[triangle][static_cast<std::size_t>(k)]];
  }
  /// Normal by the right-hand rule; its length is twice the triangle's area.
  [[nodiscard]] Vector area_normal(std::size_t triangle) const {
    return (corner(triangle, 1) - corner(triangle, 0)).cross(corner(triangle, 2) - corner(triangle, 0));
  }
};

/// A mesh that has passed check_mesh: closed, wound outward, no degenerate triangle.
struct Surface : Mesh {
  std::vector<Vector> normals;  ///< outward, unit, one per triangle
  Vector bounds_min = Vector::Zero();
  Vector bounds_max = Vector::Zero();
  double area = 0;  ///< [m^2]
};

/// Closest point of triangle abc to p, by Voronoi regions (Ericson, Real-Time Collision Detection, Sec. 5.1.5).
inline Vector closest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector ab = b - a;
  const Vector ac = c - a;
  const Vector ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const Vector cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double scale = 1 / (va + vb + vc);
  return a + ab * (vb * scale) + ac * (vc * scale);
}

}  // namespace vps
